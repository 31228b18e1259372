#!/usr/bin/env bash
# Builds the browser's page into target/web: the WebAssembly modules (target/web/webgpu has the one for graphics cards), the
# JavaScript that calls them, the page's own files. The result is a folder that any static host serves. Called by `make web`.
#
#   CARD=no   without the module for graphics cards, for which burn is compiled once more (ten minutes on two cores)
set -euo pipefail
cd "$(dirname "$0")/.."

target=wasm32-unknown-unknown
out=target/web
build=${CARGO_TARGET_DIR:-target}/wasm
cargo=${CARGO:-cargo}

source scripts/other_target.sh
choose_compiler "$target" panic_abort
[ "$compiled_by" = rustup ] || build=$build-$compiled_by

CARGO_TARGET_DIR=$build/bindgen env -u RUSTC -u RUSTC_BOOTSTRAP \
    "$cargo" build --locked --release --manifest-path crates/web/bindgen/Cargo.toml

# Builds a module into a folder; further arguments go to cargo.
build_module() {
    local folder=$1
    shift
    # Vectors of 128 bits: all current browsers have them (from Chrome 91, Firefox 89, Safari 16.4); the page informs
    # users of older browsers.
    RUSTFLAGS="-Ctarget-feature=+simd128" CARGO_TARGET_DIR=$build \
        "$cargo_for_target" rustc --locked --profile web --package sdg-web --lib --crate-type cdylib --target "$target" \
        "${standard_library[@]}" "$@"
    mkdir -p "$folder"
    "$build/bindgen/release/sdg-web-bindgen" "$build/$target/web/sdg_web.wasm" "$folder"
}

rm -rf "$out.new"
build_module "$out.new"
[ "${CARD:-}" = no ] || build_module "$out.new/webgpu" --features webgpu
cp crates/web/page/* "$out.new"
# Replaced at once, so an open page never loads half of it.
rm -rf "$out"
mv "$out.new" "$out"

compressed() { find "$@" -type f -exec gzip -9 -c {} + | wc -c; }
of_card=
[ "${CARD:-}" = no ] || of_card=", and $(($(compressed "$out/webgpu") / 1024)) KiB more for the graphics card"
echo "$out: $(($(compressed "$out" -maxdepth 1) / 1024)) KiB to download compressed$of_card; to view it: python3 -m http.server --directory $out"
