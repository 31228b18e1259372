#!/usr/bin/env bash
# Installs the template matchers that model S is compared with into a folder: install-matchers.sh FOLDER. Does nothing if they are
# installed. Separate from the networks' peers, because one environment cannot have OpenCV both with and without contrib.
set -euo pipefail

folder=$1
peers=$(cd "$(dirname "$0")" && pwd)
stamp=$(cat "$peers/matchers-requirements.txt" "$0" | cksum)
if [ "$(cat "$folder/installed" 2>/dev/null || true)" = "$stamp" ]; then
    exit 0
fi

if ! python3 -c 'import ensurepip, venv' 2>/dev/null; then
    as_root=()
    [ "$(id -u)" -eq 0 ] || as_root=(sudo)
    echo "bench: installing python3-venv" >&2
    "${as_root[@]}" apt-get update -qq
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends python3-venv >/dev/null
fi

echo "bench: installing the template matchers into $folder (once; about 90 MB to fetch)" >&2
rm -rf "$folder"
python3 -m venv "$folder"
"$folder/bin/pip" install --quiet --disable-pip-version-check --no-deps --requirement "$peers/matchers-requirements.txt"
"$folder/bin/python" -c 'import corrmatch, cv2; cv2.linemod.getDefaultLINE()'
echo "$stamp" >"$folder/installed"
