#!/usr/bin/env bash
# Builds one program twice, in two folders, and compares the files bit for bit: `scripts/reproducible.sh` (hand_checks, a minute) or
# `scripts/reproducible.sh --workspace --bin sdg` (half an hour, as burn is compiled twice). Called with the arguments of `cargo build`.
set -euo pipefail
cd "$(dirname "$0")/.."

arguments=("$@")
[ "$#" -gt 0 ] || arguments=(--package sdg-fci --example hand_checks)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
commit=$(git rev-parse HEAD)
for folder in first a/second/longer/folder; do
    mkdir -p "$work/$folder"
    git archive "$commit" | tar -x -C "$work/$folder"
    # The folder's name must not become part of the program.
    (cd "$work/$folder" && RUSTFLAGS="--remap-path-prefix=$work/$folder=." CARGO_TARGET_DIR="$work/$folder/target" \
        cargo build --quiet --release --locked "${arguments[@]}")
    # Cargo's own copies of a program have a hash in their names.
    (cd "$work/$folder/target/release" && find . -maxdepth 2 -regextype posix-extended -type f -executable \
        -not -path './build/*' -not -path './deps/*' -not -regex '.*-[0-9a-f]{16}(\.so)?' -print0 |
        sort -z | xargs -0 -r sha256sum) | tee "$work/sums-${folder%%/*}"
    [ -s "$work/sums-${folder%%/*}" ] || {
        echo "reproducible: expected programs of cargo build ${arguments[*]}, found none" >&2
        exit 1
    }
done
if cmp "$work/sums-first" "$work/sums-a"; then
    echo "reproducible: equal, of commit $commit"
else
    echo "reproducible: expected equal files from two folders, found those above" >&2
    exit 1
fi
