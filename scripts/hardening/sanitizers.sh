#!/usr/bin/env bash
# Runs unit tests under a sanitizer: `scripts/hardening/sanitizers.sh address` or `thread`, for the crates in PACKAGES. The compiler accepts the option
# with RUSTC_BOOTSTRAP; for threads the standard library is also compiled (rustup component add rust-src).
set -euo pipefail
cd "$(dirname "$0")/../.."

kind=${1:-address}
packages=${PACKAGES:-sdg-camera sdg-robot sdg-kernels}
host=$(rustc -vV | sed -n 's/^host: //p')
build_std=()
[ "$kind" = address ] || build_std=(-Zbuild-std)
export RUSTC_BOOTSTRAP=1 RUSTFLAGS="-Zsanitizer=$kind" CARGO_TARGET_DIR=target/hardening/sanitizer-$kind
# A limited file size raises a signal that ends the sanitizer's own report. Leaks are ignored, because threads outlive their tests.
export ASAN_OPTIONS=detect_leaks=0 TSAN_OPTIONS=halt_on_error=0
for package in $packages; do
    cargo test --release --locked "${build_std[@]}" --target "$host" --package "$package" --lib --tests
done
