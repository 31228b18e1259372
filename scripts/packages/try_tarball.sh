#!/usr/bin/env bash
# Unpacks a tarball in a root of the oldest supported Debian release, and uses it without network. Prints seconds.
# Usage: try_tarball.sh TARBALL
set -euo pipefail
cd "$(dirname "$0")/../.."

tarball=$1
root=$(realpath -m target/packages/tarball-root)
scripts/packages/clean_root.sh bullseye "$root"
start=$(date +%s.%N)
tar --extract --xz --file "$tarball" --directory "$root/opt"
cp scripts/packages/first_grasp.sh "$root/first_grasp.sh"
folder=/opt/$(basename "$tarball" .tar.xz)
unshare --mount --net --pid --fork chroot "$root" sh /first_grasp.sh "$folder/bin/sdg" "$folder/share/single-demo-grasp" /tmp 2>&1 | tail -2
echo "tarball: from unpacking to the grasp drawn on a photo, glibc $(chroot "$root" ldd --version | head -1 | grep -o '[0-9.]*$'): \
$(echo "$(date +%s.%N) - $start" | bc | cut -c 1-5) s"

# An older C library, and one that is not glibc, as getconf reports them.
for reported in 'echo glibc 2.28' 'exit 1'; do
    printf '#!/bin/sh\n%s\n' "$reported" >"$root/tmp/getconf"
    chmod 755 "$root/tmp/getconf"
    told=$(chroot "$root" env PATH="/tmp:$PATH" "$folder/bin/sdg" --version 2>&1) && { echo "tarball: sdg ran although getconf: $reported" >&2; exit 1; }
    [ "$(wc -l <<<"$told")" = 1 ] && grep -q 'expected glibc 2.31 or later' <<<"$told" || { echo "tarball: $told" >&2; exit 1; }
    echo "tarball: $told"
done
