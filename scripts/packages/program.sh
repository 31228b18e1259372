#!/usr/bin/env bash
# Builds the `sdg` that packages hold, into target/packages/program: for x86-64 with glibc 2.31 or later (Debian 11, Ubuntu 20.04),
# with zig's linker, which has the older library's symbols. Nothing but the C library is linked; MuJoCo and EGL are loaded by
# those verbs that simulate.
set -euo pipefail
cd "$(dirname "$0")/../.."

GLIBC=2.31
triple=x86_64-unknown-linux-gnu
program=target/packages/program
tools=target/packages/tools

scripts/install.sh python3-venv binutils
if [ ! -x "$tools/bin/cargo-zigbuild" ]; then
    python3 -m venv "$tools"
    "$tools/bin/pip" --quiet --disable-pip-version-check install 'cargo-zigbuild==0.24.1' 'ziglang==0.17.1'
fi
# A target directory of its own: it is another linker's and another profile's.
PATH=$PWD/$tools/bin:$PATH CARGO_TARGET_DIR=target/packages/target \
    "${CARGO:-cargo}" zigbuild --locked --profile ship --target "$triple.$GLIBC" --package sdg-cli --bin sdg

mkdir -p "$program"
cp "target/packages/target/$triple/ship/sdg" "$program/sdg.new"
newest=$(objdump -T "$program/sdg.new" | grep -o 'GLIBC_[0-9.]*' | sort -Vu | tail -1)
if [ "$(printf '%s\n' "$newest" "GLIBC_$GLIBC" | sort -V | tail -1)" != "GLIBC_$GLIBC" ]; then
    echo "packages: sdg needs $newest, and GLIBC_$GLIBC is promised" >&2
    exit 1
fi
if linked=$(objdump -p "$program/sdg.new" | grep NEEDED | grep -Ev 'lib(c|m|dl|pthread|rt|gcc_s)\.so|ld-linux'); then
    echo "packages: sdg links $linked" >&2
    exit 1
fi
mv "$program/sdg.new" "$program/sdg"
echo "packages: $program/sdg, $(stat -c %s "$program/sdg") bytes, needs $newest"
