#!/usr/bin/env bash
# Runs unit tests that need no simulator for arm64 with zig's linker, under qemu if this machine is of another kind; `make test-arm64`.
# Complete teachings are left out: emulated they take an hour, and `make tarball ARCH=arm64 TRY=1` does one. Usage: test_arm64.sh [ARGUMENTS of the tests' programs]
set -euo pipefail
cd "$(dirname "$0")/../.."
ARCH=arm64
source scripts/packages/arch.sh
PROFILE=${PROFILE:-release}
source scripts/packages/zig.sh

# Always these together, including the program: libraries then have the same features as in the program, and burn is compiled once.
packages=(cli geometry picture files kinematics demonstration kernels shape sift grasp)
# Two tests start their own program, which fails if the kernel cannot run that machine's programs; fits of constants take too long.
skipped=()
[ ${#emulated[@]} = 0 ] || skipped=(--skip a_write_cut_short_leaves_the_old_file --skip a_second_sigterm_or_one_at_a_question --skip fitting::)
zig_cargo test --lib --no-fail-fast "${packages[@]/#/--package=sdg-}" -- "${skipped[@]}" "$@"
