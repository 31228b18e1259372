#!/usr/bin/env bash
# Installs onnxruntime-web and Chromium, with which our page is compared: install.sh FOLDER. Does nothing if both are installed.
set -euo pipefail

version=1.30.0
folder=$1

"$(dirname "$0")/../../scripts/install.sh" chromium chromium-driver
if [ "$(cat "$folder/installed" 2>/dev/null || true)" = "$version" ]; then
    exit 0
fi
if ! command -v npm >/dev/null; then
    echo "bench: npm is missing, which fetches onnxruntime-web (Debian's package npm)" >&2
    exit 1
fi
mkdir -p "$folder"
# The package's install script fetches a library for Node, which no browser needs.
npm install --prefix "$folder" --no-save --no-audit --no-fund --ignore-scripts --silent "onnxruntime-web@$version"
echo "$version" >"$folder/installed"
