#!/usr/bin/env bash
# Builds the Python package's wheel into target/wheels. Called by `make wheel`.
#
# In the release profile and with the features of the workspace, so the libraries of `make build`, above all burn, are not compiled again:
# crates/bindings/Cargo.toml explains this.
set -euo pipefail
cd "$(dirname "$0")/../.."

scripts/python/venv.sh target/python/build maturin==1.16.0
rm -f target/wheels/single_demo_grasp-*.whl
target/python/build/bin/maturin build --release --manifest-path python/Cargo.toml --out target/wheels \
    --interpreter target/python/build/bin/python "$@"
