#!/usr/bin/env bash
# Installs the program and its files under a folder: bin, manual pages, completions, the shipped photos with their marks, licences.
# Usage: lay_out.sh PREFIX
set -euo pipefail
cd "$(dirname "$0")/../.."
date=$(scripts/packages/commit_date.sh)
source scripts/packages/arch.sh

prefix=$1
sdg=("${emulated[@]}" "$program/sdg")
install -D -m 755 "$program/sdg" "$prefix/bin/sdg"
install -d "$prefix/share/man/man1"
"${sdg[@]}" man --out "$prefix/share/man/man1" >/dev/null
gzip -9n "$prefix/share/man/man1"/*
for shell in bash zsh fish; do
    case $shell in
        bash) file=bash-completion/completions/sdg ;;
        zsh) file=zsh/vendor-completions/_sdg ;;
        fish) file=fish/vendor_completions.d/sdg.fish ;;
    esac
    install -d "$(dirname "$prefix/share/$file")"
    "${sdg[@]}" completions "$shell" >"$prefix/share/$file"
done
for part in datasets/demonstrations/*/; do
    install -D -m 644 -t "$prefix/share/single-demo-grasp/$(basename "$part")" "$part"image.png "$part"annotation.json
done
install -D -m 644 -t "$prefix/share/doc/single-demo-grasp" LICENSE-MIT LICENSE-APACHE
gzip -9nc CHANGELOG.md >"$prefix/share/doc/single-demo-grasp/changelog.gz"
chmod -R u=rwX,go=rX "$prefix"
# With the commit's date, so the result always has the same bytes.
find "$prefix" -exec touch --no-dereference --date "@$date" {} +
