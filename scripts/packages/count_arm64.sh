#!/usr/bin/env bash
# Counts the instructions of a convolution on arm64 under qemu: with NEON's lanes, with the same kernel over arrays, and with plain loops.
# Every instruction is a separate block, and qemu writes a line per block; the count of one round is the difference of the counts of two rounds and one.
# Usage: count_arm64.sh TEST-PROGRAM of sdg-kernels (`make test-arm64` names it)
set -euo pipefail

count() {
    RAYON_NUM_THREADS=1 SDG_COUNTED="$1" qemu-aarch64-static -L /usr/aarch64-linux-gnu -singlestep -d nochain,exec -D /dev/stderr \
        "$program" --exact conv::kernel_tests::counted --ignored --test-threads 1 2>&1 >/dev/null | grep -c '^Trace'
}
program=$1
printf '%-20s %s\n' lanes instructions
for way in "vectors direct" "portable direct" "vectors any" "portable any" "loops direct"; do
    printf '%-20s %s\n' "$way" $(($(count "$way 2") - $(count "$way 1")))
done
