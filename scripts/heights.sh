#!/usr/bin/env bash
# Grasps with unknown height: from tables 0 to 40 mm higher than configured and from blocks 5 to 30 mm high, ten grasps of each of the twelve parts, model S.
# The example defines a failure. HEIGHTS=2 for two of each part.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/build.sh --example heights
"${CARGO_TARGET_DIR:-target}/release/examples/heights" grasp "${HEIGHTS:-10}" "${HEIGHTS_SEED:-201}"
