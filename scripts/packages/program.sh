#!/usr/bin/env bash
# Builds the packages' program `sdg` into target/packages/program/ARCH, for ARCH=amd64 or arm64 with glibc 2.31 or later. Only the C
# library and libgcc_s are linked; the commands that simulate load MuJoCo and EGL.
set -euo pipefail
cd "$(dirname "$0")/../.."
source scripts/packages/arch.sh
source scripts/packages/zig.sh

scripts/install.sh binutils
# Only `sdg` is built. The Python package is named so that cargo chooses the features of both, and wheel.sh uses the same compiled crates.
zig_cargo zigbuild --package sdg-cli --package sdg-python --features sdg-python/extension --bin sdg

mkdir -p "$program"
cp "$built/sdg" "$program/sdg.new"
# readelf reads programs of any machine, unlike objdump.
newest=$(readelf --wide --version-info "$program/sdg.new" | grep -o 'GLIBC_[0-9.]*' | sort -Vu | tail -1)
if [ "$(printf '%s\n' "$newest" "GLIBC_$GLIBC" | sort -V | tail -1)" != "GLIBC_$GLIBC" ]; then
    echo "packages: sdg needs $newest, and GLIBC_$GLIBC is promised" >&2
    exit 1
fi
if linked=$(readelf --wide --dynamic "$program/sdg.new" | grep NEEDED | grep -Ev '\[(lib(c|m|dl|pthread|rt|gcc_s)\.so|ld-linux)'); then
    echo "packages: sdg links $linked" >&2
    exit 1
fi
mv "$program/sdg.new" "$program/sdg"
echo "packages: $program/sdg, $(stat -c %s "$program/sdg") bytes, needs $newest"
