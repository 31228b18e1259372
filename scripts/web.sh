#!/usr/bin/env bash
# Builds the browser's page into target/web: the WebAssembly module, the JavaScript that calls it, the page's own files.
# The result is a folder that any static host serves. Called by `make web`.
#
# Rust's WebAssembly target comes from rustup. Where there is none to be had, Debian's compiler for it is taken, which
# brings the standard library as source: packages rustc-web, cargo-web, rust-web-src, lld-22.
set -euo pipefail
cd "$(dirname "$0")/.."

target=wasm32-unknown-unknown
out=target/web
build=${CARGO_TARGET_DIR:-target}/wasm
cargo=${CARGO:-cargo}

has_target() { [ -d "$(rustc --print sysroot)/lib/rustlib/$target" ]; }

cargo_for_web=("$cargo")
standard_library=()
if ! has_target; then
    if command -v rustup >/dev/null && timeout 120 rustup target add "$target" >&2 && has_target; then
        :
    elif command -v apt-get >/dev/null; then
        scripts/install.sh rustc-web cargo-web rust-web-src lld-22
        # The standard library is compiled beside ours, which the compiler allows its own maker only.
        export RUSTC=/usr/bin/rustc RUSTC_BOOTSTRAP=1
        cargo_for_web=(/usr/bin/cargo)
        standard_library=(-Zbuild-std=std,panic_abort)
        build=$build-debian
    else
        echo "web: Rust's target $target is missing: rustup target add $target" >&2
        exit 1
    fi
fi

# Vectors of 128 bits: every browser has them (Chrome 91, Firefox 89, Safari 16.4); the page tells those that do not.
RUSTFLAGS="-Ctarget-feature=+simd128" CARGO_TARGET_DIR=$build \
    "${cargo_for_web[@]}" rustc --locked --profile web --package sdg-web --lib --crate-type cdylib --target "$target" \
    "${standard_library[@]}"

unset RUSTC RUSTC_BOOTSTRAP
CARGO_TARGET_DIR=$build/bindgen "$cargo" build --locked --release --manifest-path crates/web/bindgen/Cargo.toml

rm -rf "$out.new"
mkdir -p "$out.new"
"$build/bindgen/release/sdg-web-bindgen" "$build/$target/web/sdg_web.wasm" "$out.new"
cp crates/web/page/* "$out.new"
# Whole or not at all: a page that is open meanwhile never sees half of it.
rm -rf "$out"
mv "$out.new" "$out"

compressed=0
for file in "$out"/*; do
    compressed=$((compressed + $(gzip -9 -c "$file" | wc -c)))
done
echo "$out: $(du -sk "$out" | cut -f1) KiB, $((compressed / 1024)) KiB to download compressed; for one, python3 -m http.server --directory $out"
