#!/usr/bin/env bash
# Parts placed in a tray of 20 cells, and grasps from a table that is 5 mm higher than configured, with 1 Nm of friction in every joint: in
# one process, and over TCP and UDP in lockstep. The example defines a failure.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/build.sh --example placing
example=${CARGO_TARGET_DIR:-target}/release/examples/placing
for where in process lockstep; do
    for what in tray heights; do
        echo "== $what, $where"
        "$example" "$what" "$where"
    done
done
