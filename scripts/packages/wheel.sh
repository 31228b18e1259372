#!/usr/bin/env bash
# Builds the Python package's wheel for glibc 2.31 or later into target/packages/wheel, for ARCH=amd64 or arm64; part of `make release`.
# `make wheel` builds one for the C library of this machine, without compiling burn again. With TRY=1 it is then used in Debian 11 (needs
# root and mmdebstrap).
set -euo pipefail
cd "$(dirname "$0")/../.."
source scripts/packages/arch.sh
source scripts/packages/zig.sh

out=target/packages/wheel
scripts/python/venv.sh target/python/build maturin==1.16.0
mkdir -p "$out"
rm -f "$out"/single_demo_grasp-*"$machine".whl
# zigbuild calls maturin instead of cargo, so that the linker and with it the compiled crates are those of program.sh. maturin refuses a
# library that needs symbols newer than the tag of --compatibility.
cat >"$tools/maturin-cargo" <<END
#!/bin/sh
[ "\$1" = build ] || exec "$cargo_for_target" "\$@"
CARGO="$cargo_for_target" exec target/python/build/bin/maturin build --compatibility "manylinux_${GLIBC/./_}" --profile "$profile" \\
    --target "$triple" --manifest-path python/Cargo.toml --out "$out" ${standard_library[*]/#-Z/-Z }
END
chmod +x "$tools/maturin-cargo"
cargo_for_target=$PWD/$tools/maturin-cargo zig_cargo zigbuild
wheel=$(echo "$out"/single_demo_grasp-*"$machine".whl)
echo "wheel: $wheel, $(stat -c %s "$wheel") bytes"
[ -z "${TRY:-}" ] || scripts/packages/try_wheel.sh "$wheel"
