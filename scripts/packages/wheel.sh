#!/usr/bin/env bash
# Builds the Python package's wheel for glibc 2.31 or later into target/packages/wheel, for ARCH=amd64 or arm64; part of `make release`.
# `make wheel` builds one for the C library of this machine, without compiling burn again. With TRY=1 it is then used in Debian 11 (needs
# root and mmdebstrap; amd64).
set -euo pipefail
cd "$(dirname "$0")/../.."
source scripts/packages/arch.sh
source scripts/packages/zig.sh

out=target/packages/wheel
scripts/python/venv.sh target/python/build maturin==1.16.0
mkdir -p "$out"
rm -f "$out"/single_demo_grasp-*"$machine".whl
# maturin refuses a library that needs symbols newer than this tag.
env PATH="$PWD/$tools/bin:$PATH" CARGO="$cargo_for_target" CARGO_TARGET_DIR="$zig_target" \
    target/python/build/bin/maturin build --zig --compatibility "manylinux_${GLIBC/./_}" --profile "$profile" --target "$triple" \
    --manifest-path python/Cargo.toml --out "$out" "${standard_library[@]/#-Z/-Z }"
wheel=$(echo "$out"/single_demo_grasp-*"$machine".whl)
echo "wheel: $wheel, $(stat -c %s "$wheel") bytes"
[ -z "${TRY:-}" ] || scripts/packages/try_wheel.sh "$wheel"
