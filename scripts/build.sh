#!/usr/bin/env bash
# Builds what the arguments name (`--bin sdg`) in the release profile. Called by `make build` and by other scripts.
#
# Always of the whole workspace and with one example, the smallest: cargo then chooses the libraries' features as it does for
# `make test`, which so finds burn compiled. With `-p sdg-cli` it would be compiled twice.
set -euo pipefail
cd "$(dirname "$0")/.."

exec "${CARGO:-cargo}" build --release --locked --workspace --example hand_checks "$@"
