#!/usr/bin/env bash
# Runs tests under a sanitizer: `scripts/hardening/sanitizers.sh address` or `thread`, for the crates in PACKAGES. The compiler accepts the option
# with RUSTC_BOOTSTRAP. For threads the standard library is also compiled, by Debian's compiler, which has its source; LLVM's runtime is used,
# because Debian's compiler has none.
set -euo pipefail
cd "$(dirname "$0")/../.."

kind=${1:-address}
packages=${PACKAGES:-sdg-camera sdg-robot sdg-kernels sdg-fci}
host=$(rustc -vV | sed -n 's/^host: //p')
cargo=cargo
build_std=()
export RUSTC_BOOTSTRAP=1 RUSTFLAGS="-Zsanitizer=$kind" CARGO_TARGET_DIR=target/hardening/sanitizer-$kind
if [ "$kind" = thread ]; then
    scripts/install.sh rustc-web cargo-web rust-web-src lld-22 libclang-rt-22-dev
    llvm=/usr/lib/llvm-22
    runtime=$llvm/lib/clang/22/lib/linux/libclang_rt.tsan-${host%%-*}.a
    export RUSTC=/usr/bin/rustc
    cargo=/usr/bin/cargo
    build_std=(-Zbuild-std=std,panic_unwind,test,proc_macro)
    RUSTFLAGS+=" -Zexternal-clangrt -Clink-arg=-Wl,--whole-archive,$runtime,--no-whole-archive,--export-dynamic,--no-as-needed"
    RUSTFLAGS+=" -Clink-arg=-lrt -Clink-arg=-lm -Clink-arg=-ldl -Clink-arg=-lpthread -Clink-arg=-lc"
    RUSTFLAGS+=" -Clink-arg=-fuse-ld=lld -Clink-arg=-B$llvm/bin"
fi
# Leaks are ignored, because threads outlive their tests.
export ASAN_OPTIONS=detect_leaks=0 TSAN_OPTIONS="halt_on_error=0 suppressions=$PWD/scripts/hardening/tsan.txt"
for package in $packages; do
    "$cargo" test --release --locked "${build_std[@]}" --target "$host" --package "$package" --lib --tests
done
