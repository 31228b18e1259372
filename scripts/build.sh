#!/usr/bin/env bash
# Builds the targets in the arguments (`--bin sdg`) in the release profile. Called by `make build` and by other scripts.
#
# Always builds from the whole workspace and with the smallest example: cargo then chooses the same features of the libraries as
# `make test`, so burn is compiled only once. With `-p sdg-cli` it would be compiled twice.
set -euo pipefail
cd "$(dirname "$0")/.."

exec "${CARGO:-cargo}" build --release --locked --workspace --example hand_checks "$@"
