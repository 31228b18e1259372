#!/usr/bin/env bash
# Lists the contents of the program: every crate with version and licence, as CycloneDX JSON. Usage: sbom.sh FILE
set -euo pipefail
cd "$(dirname "$0")/../.."

tools=target/packages/tools
[ -x "$tools/bin/cargo-cyclonedx" ] || env -u CARGO_TARGET_DIR cargo install --quiet --debug --locked --root "$tools" cargo-cyclonedx@0.5.9
# cargo-cyclonedx writes a file into the folder of each member of the workspace.
name=sdg-what-is-in-it
trap 'find . -path ./target -prune -o -name "$name.json" -exec rm {} +' EXIT
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct) "$tools/bin/cargo-cyclonedx" cyclonedx --quiet --manifest-path crates/cli/Cargo.toml \
    --format json --spec-version 1.5 --target x86_64-unknown-linux-gnu --no-build-deps --override-filename "$name"
mkdir -p "$(dirname "$1")"
cargo tree --locked --package sdg-cli --target x86_64-unknown-linux-gnu --edges normal --prefix none --format '{p}' |
    python3 scripts/packages/keep_linked.py "crates/cli/$name.json"
mv "crates/cli/$name.json" "$1"
echo "release: $1, $(python3 -c 'import json, sys; print(len(json.load(open(sys.argv[1]))["components"]))' "$1") crates"
