#!/usr/bin/env bash
# Builds `sdg` for small machines into target/edge/sdg and measures it; further arguments go to `sdg-bench edge`.
# Called by `make edge`.
set -euo pipefail
cd "$(dirname "$0")/.."

cargo=${CARGO:-cargo}
built=${CARGO_TARGET_DIR:-target}/release
edge=target/edge

build_all() { "$cargo" build --quiet --locked --release --workspace --bins --example try_views; }

build_all
# Beside the simulator, which the program does not link, so that burn has the features that it was compiled with for the
# workspace: alone (`cargo build --release -p sdg-cli --no-default-features`) it is the same program and five minutes more.
trap build_all EXIT # target/release/sdg is again the one with the simulator.
"$cargo" build --locked --release --no-default-features --package sdg-cli --package sdg-simulation
mkdir -p "$edge"
cp "$built/sdg" "$edge/sdg.new"
mv "$edge/sdg.new" "$edge/sdg"

for library in libmujoco libEGL libGL; do
    if ldd "$edge/sdg" | grep -q "$library"; then
        echo "edge: $edge/sdg links $library" >&2
        exit 1
    fi
done
"$built/sdg-bench" edge "$edge/sdg" "$@"
