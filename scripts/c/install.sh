#!/usr/bin/env bash
# Builds the C library and installs it into a folder: lib, include, files of pkg-config and CMake. The folder can be moved.
# `make capi`: target/capi. Usage: install.sh FOLDER
set -euo pipefail
folder=$(realpath -m "$1")
cd "$(dirname "$0")/../.."

scripts/build.sh --example sdg
version=$(sed -n '/^\[workspace.package\]/,/^\[/s/^version = "\(.*\)"/\1/p' Cargo.toml)
abi=$(sed -n 's/^#define SDG_ABI_VERSION \([0-9]*\)u$/\1/p' crates/capi/include/sdg.h)
: "${version:?}" "${abi:?}"

# Only our own files: the folder can be one like /usr/local.
rm -rf "$folder"/lib/libsdg.so* "$folder/lib/pkgconfig/sdg.pc" "$folder/lib/cmake/sdg" "$folder/include/sdg.h"
mkdir -p "$folder"/{lib/pkgconfig,lib/cmake/sdg,include}
cp crates/capi/include/sdg.h "$folder/include/"
cp "${CARGO_TARGET_DIR:-target}/release/examples/libsdg.so" "$folder/lib/libsdg.so.$abi"
ln -s "libsdg.so.$abi" "$folder/lib/libsdg.so"
for file in pkgconfig/sdg.pc cmake/sdg/sdg-config.cmake cmake/sdg/sdg-config-version.cmake; do
    sed -e "s/@VERSION@/$version/" -e "s/@ABI@/$abi/" "crates/capi/installed/${file##*/}" >"$folder/lib/$file"
done
echo "C library $version (ABI $abi): $folder, $(stat -c %s "$folder/lib/libsdg.so.$abi") bytes"
