#!/usr/bin/env bash
# Installs the wheel into a clean environment and runs python/tests there, which compare it with Rust's programs. Called by `make test-python`.
set -euo pipefail
cd "$(dirname "$0")/../.."

scripts/build.sh --bin sdg --example reference
scripts/python/test_venv.sh
# Prints measurements. pytest's own command adds neither this folder nor python/ to the path, so the wheel's files are tested.
PYTHONDONTWRITEBYTECODE=1 target/python/test/bin/pytest -p no:cacheprovider -rP python/tests "$@"
