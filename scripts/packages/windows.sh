#!/usr/bin/env bash
# Builds sdg.exe for 64-bit Windows without simulator (teach, detect, annotate) by mingw-w64, and a zip of it with the shipped photos,
# target/packages/windows/single-demo-grasp-VERSION-windows-x86_64.zip; `make windows`. With TRY=1 it is then tried under Wine.
set -euo pipefail
cd "$(dirname "$0")/../.."
date=$(scripts/packages/commit_date.sh)
source scripts/other_target.sh

triple=x86_64-pc-windows-gnu
profile=${PROFILE:-ship}
scripts/install.sh gcc-mingw-w64-x86-64 binutils-mingw-w64-x86-64 zip
choose_compiler "$triple"
folder=target/packages/target-windows
[ "$compiled_by" = rustup ] || folder=$folder-$compiled_by
CARGO_TARGET_DIR=$folder "$cargo_for_target" build --locked --profile "$profile" --target "$triple" "${standard_library[@]}" \
    --package sdg-cli --bin sdg --no-default-features --features annotate,base-weights
exe=$folder/$triple/$profile/sdg.exe
# Only libraries of Windows may be linked: a library of mingw would have to be shipped.
if linked=$(x86_64-w64-mingw32-objdump -p "$exe" | sed -n 's/.*DLL Name: //p' | grep -Evi '^(api-ms-win-.*|kernel32|ntdll|msvcrt|ws2_32|userenv|advapi32|bcrypt.*|user32|shell32|ole32|combase)\.dll$'); then
    echo "windows: sdg.exe needs" $linked >&2
    exit 1
fi

version=$(sed -n '/^\[workspace.package\]/,/^version/s/^version = "\(.*\)"/\1/p' Cargo.toml)
out=target/packages/windows
name=single-demo-grasp-$version-windows-x86_64
rm -rf "${out:?}/$name"
mkdir -p "$out/$name/licences"
cp "$exe" "$out/$name/sdg.exe"
cp LICENSE-MIT LICENSE-APACHE "$out/$name/licences"
for part in datasets/demonstrations/*/; do
    install -D -m 644 -t "$out/$name/photos/$(basename "$part")" "$part"image.png "$part"annotation.json
done
find "$out/$name" -exec touch --date "@$date" {} +
zip=$(realpath "$out")/$name.zip
rm -f "$zip"
(cd "$out" && find "$name" -print | sort | TZ=UTC zip --quiet -X "$zip" -@)
rm -rf "${out:?}/$name"
echo "windows: $zip, $(stat -c %s "$zip") bytes"
[ -z "${TRY:-}" ] || scripts/packages/try_windows.sh "$zip"
