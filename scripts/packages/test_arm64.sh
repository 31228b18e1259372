#!/usr/bin/env bash
# Unit tests that need no simulator, for arm64 with zig's linker, under qemu where this machine is another; `make test-arm64`.
# Whole teachings are left out: emulated they take an hour, and `make tarball ARCH=arm64 TRY=1` does one. Usage: test_arm64.sh [ARGUMENTS of the tests' programs]
set -euo pipefail
cd "$(dirname "$0")/../.."
ARCH=arm64
source scripts/packages/arch.sh
PROFILE=${PROFILE:-release}
source scripts/packages/zig.sh

# Always these together, the program among them: libraries then have the features that they have in the program, and burn is compiled once.
packages=(cli geometry picture files kinematics demonstration kernels shape sift grasp)
# One test starts itself once more, which the kernel cannot where it does not know that machine's programs; fits of constants take too long.
skipped=()
[ ${#emulated[@]} = 0 ] || skipped=(--skip a_write_cut_short_leaves_the_old_file --skip fitting::)
zig_cargo test --lib --no-fail-fast "${packages[@]/#/--package=sdg-}" -- "${skipped[@]}" "$@"
