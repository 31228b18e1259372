#!/usr/bin/env bash
# Uses a tarball or package for arm64 under qemu with the C library of Debian 11's arm64 (glibc 2.31), without network and not as root,
# and compares the grasps of PARTS (the pendulum) with those of this machine's program, if there is one.
# Usage: try_arm64.sh TARBALL|PACKAGE
set -euo pipefail
cd "$(dirname "$0")/../.."
ARCH=arm64 source scripts/packages/arch.sh

package=$(realpath "$1")
root=$(realpath -m target/packages/arm64-root)
scripts/install.sh mmdebstrap qemu-user-static
rm -rf "$root"
# No program runs in this root, so the kernel needs no support for arm64. It has the release's own library, not a later security update.
mmdebstrap --quiet --variant=extract --skip=check/qemu --architectures=arm64 --include=libc6/bullseye,libgcc-s1 bullseye "$root" 2>/dev/null
mkdir -p "$root/opt" "$root/tmp"
start=$(date +%s.%N)
case $package in
    *.deb)
        dpkg --root="$root" --force-architecture --force-depends --install "$package" >/dev/null 2>&1
        installed=$root/usr
        program_file=$installed/bin/sdg
        ;;
    *)
        tar --extract --xz --file "$package" --directory "$root/opt"
        installed=$(echo "$root"/opt/*/)
        program_file=$installed/lib/sdg
        ;;
esac
# A home folder that does not exist, and a folder with a space and an umlaut.
folder="$root/tmp/erste Größe"
mkdir -p "$folder"
chmod 755 "$root"
chown nobody "$folder"
cat >"$root/sdg" <<END
#!/bin/sh
exec qemu-aarch64-static -L "$root" "$program_file" "\$@"
END
chmod 755 "$root/sdg"
as_nobody() { unshare --net setpriv --reuid nobody --regid nogroup --clear-groups env HOME=/nonexistent "$@"; }
photos=$installed/share/single-demo-grasp
as_nobody sh scripts/packages/first_grasp.sh "$root/sdg" "$photos" "$folder" 2>&1 | tail -2
echo "arm64: from installing to the grasp drawn on a photo, under qemu with $(basename "$(ls "$root"/lib/aarch64-linux-gnu/libc-*.so)"): \
$(echo "$(date +%s.%N) - $start" | bc | cut -c 1-5) s"
told=$(as_nobody "$root/sdg" demo --out "$folder/demo" 2>&1) && { echo "arm64: demo ran without MuJoCo" >&2; exit 1; }
[ "$(wc -l <<<"$told")" = 1 ] && grep -q 'libmujoco2.2.2' <<<"$told" || { echo "arm64: demo without MuJoCo said: $told" >&2; exit 1; }

native=target/packages/program/amd64/sdg
[ "$(uname -m)" = x86_64 ] && [ -x "$native" ] || exit 0
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for part in ${PARTS:-pendulum}; do
    for program in "$root/sdg" "$native"; do
        "$program" teach --model S --demo "$photos/$part/image.png:$photos/$part/annotation.json" --out "$work/part.sdg" >/dev/null 2>&1
        "$program" detect --grasp-model "$work/part.sdg" --json "$photos/$part/image.png"
    done | python3 scripts/packages/same_grasp.py "$part"
done
