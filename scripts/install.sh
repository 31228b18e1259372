#!/usr/bin/env bash
# Installs the given Debian packages that are missing; uses sudo only if not root.
set -euo pipefail

missing=()
native=$(dpkg --print-architecture 2>/dev/null || true)
for package in "$@"; do
    # A package may be installed for several architectures; a name without one means this machine's.
    wanted=$native
    [[ "$package" != *:* ]] || wanted=${package#*:}
    dpkg-query -W -f '${db:Status-Status} ${Architecture}\n' "$package" 2>/dev/null |
        grep -xE "installed ($wanted|all)" >/dev/null || missing+=("$package")
done
[ ${#missing[@]} -gt 0 ] || exit 0

as_root=()
if [ "$(id -u)" -ne 0 ]; then
    if ! command -v sudo >/dev/null; then
        echo "setup: as root, run: apt-get install ${missing[*]}" >&2
        exit 1
    fi
    as_root=(sudo)
fi
echo "setup: installing ${missing[*]}" >&2
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
