#!/usr/bin/env bash
# Uses the zip for Windows under Wine: teaches, detects and draws, opens the page, and runs commands that it lacks. Usage: try_windows.sh ZIP
set -euo pipefail
cd "$(dirname "$0")/../.."

zip=$(realpath "$1")
scripts/install.sh wine64 unzip curl
wine=$(command -v wine64 || command -v wine || echo /usr/lib/wine/wine64)
server=$(command -v wineserver || echo /usr/lib/wine/wineserver)
work=$(realpath -m target/packages/windows-try)
rm -rf "$work"
mkdir -p "$work/erste Größe"
export WINEPREFIX=$work/prefix WINEDEBUG=-all LC_ALL=C.UTF-8
"$wine" wineboot --init >/dev/null 2>&1 || true
start=$(date +%s.%N)
unzip -q "$zip" -d "$work"
folder=$work/$(basename "$zip" .zip)
# Windows' source of random numbers: Windows 10 has it, but Debian 12's Wine 8 lacks it.
echo '#include <windows.h>
BOOLEAN NTAPI SystemFunction036(PVOID, ULONG);
__declspec(dllexport) BOOL WINAPI ProcessPrng(PBYTE bytes, SIZE_T count) { return SystemFunction036(bytes, count); }' >"$work/random.c"
x86_64-w64-mingw32-gcc -shared -o "$folder/bcryptprimitives.dll" "$work/random.c" -ladvapi32
cat >"$work/sdg" <<END
#!/bin/sh
exec "$wine" "$folder/sdg.exe" "\$@"
END
chmod +x "$work/sdg"
cd "$work/erste Größe"
sh "$OLDPWD/scripts/packages/first_grasp.sh" "$work/sdg" "$folder/photos" . 2>&1 | tail -1
echo "windows: from unpacking to the grasp drawn on a photo, under $("$wine" --version): $(echo "$(date +%s.%N) - $start" | bc | cut -c 1-5) s"

# A missing command is reported in one line.
for verb in "demo" "simulate --fci" "camera grab --from v4l:/dev/video0 --out picture.png"; do
    told=$("$work/sdg" $verb 2>&1) && { echo "windows: $verb did not fail" >&2; exit 1; }
    [ "$(wc -l <<<"$told")" = 1 ] || { echo "windows: $verb said: $told" >&2; exit 1; }
    echo "windows: sdg $verb: $told"
done

cp "$folder/photos/pendulum/image.png" photo.png
"$work/sdg" annotate --no-browser --json photo.png >address &
page=$!
trap 'kill "$page" 2>/dev/null || true; "$server" -k 2>/dev/null || true' EXIT
for _ in $(seq 100); do [ -s address ] && break; sleep 0.3; done
url=$(sed -n 's/.*"url":"\([^"]*\)".*/\1/p' address)
echo "windows: the page answers: $(curl --silent --output page.html --write-out '%{http_code}, %{size_download} bytes' "$url")"
grep -q '<html' page.html
