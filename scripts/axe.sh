#!/usr/bin/env bash
# Fetches axe-core, which checks the accessibility of our pages in the browser tests, from npm into target/browser-test; does
# nothing if it is installed. It is not in this repository because of its licence (MPL-2.0).
set -euo pipefail
cd "$(dirname "$0")/.."

version=4.10.3
folder=target/browser-test/npm
if grep -qs "\"version\": \"$version\"" "$folder/node_modules/axe-core/package.json"; then
    exit 0
fi
command -v npm >/dev/null || scripts/install.sh npm
mkdir -p "$folder"
npm install --prefix "$folder" --no-save --no-audit --no-fund --silent "axe-core@$version"
