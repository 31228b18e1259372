#!/usr/bin/env bash
# Builds `sdg` for small machines into target/edge/sdg, in the profile for distribution, and measures it; further arguments are passed
# to `sdg-bench edge`. Called by `make edge`.
set -euo pipefail
cd "$(dirname "$0")/.."

cargo=${CARGO:-cargo}
target=${CARGO_TARGET_DIR:-target}
edge=target/edge

scripts/build.sh --bin sdg-bench
# Without the simulator, which the program does not link.
"$cargo" build --locked --profile ship --no-default-features --package sdg-cli
mkdir -p "$edge"
cp "$target/ship/sdg" "$edge/sdg.new"
mv "$edge/sdg.new" "$edge/sdg"

for library in libmujoco libEGL libGL; do
    if ldd "$edge/sdg" | grep -q "$library"; then
        echo "edge: $edge/sdg links $library" >&2
        exit 1
    fi
done
"$target/release/sdg-bench" edge "$edge/sdg" "$@"
