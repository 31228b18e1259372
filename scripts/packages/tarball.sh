#!/usr/bin/env bash
# Makes a tarball of one folder that runs with glibc 2.31 or later, target/packages/tarball/single-demo-grasp-VERSION-MACHINE-linux.tar.xz;
# `make tarball`. With TRY=1 it is then used in Debian 11, the oldest release with that library (needs root and mmdebstrap).
set -euo pipefail
cd "$(dirname "$0")/../.."
date=$(scripts/packages/commit_date.sh)
source scripts/packages/arch.sh

scripts/install.sh xz-utils
scripts/packages/program.sh
version=$("${emulated[@]}" "$program/sdg" --version | cut -d ' ' -f 2)
out=target/packages/tarball
name=single-demo-grasp-$version-$machine-linux
rm -rf "${out:?}/$name"
scripts/packages/lay_out.sh "$out/$name"
install -d "$out/$name/lib"
mv "$out/$name/bin/sdg" "$out/$name/lib/sdg"
install -m 755 scripts/packages/start.sh "$out/$name/bin/sdg"
tarball=$out/$name.tar.xz
tar --create --xz --file "$tarball.new" --directory "$out" --sort=name --owner=0 --group=0 --numeric-owner \
    --mtime "@$date" "$name"
mv "$tarball.new" "$tarball"
rm -rf "${out:?}/$name"
echo "tarball: $tarball, $(stat -c %s "$tarball") bytes"
try=try_tarball
[ "$arch" = amd64 ] || try=try_$arch
[ -z "${TRY:-}" ] || scripts/packages/$try.sh "$tarball"
