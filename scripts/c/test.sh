#!/usr/bin/env bash
# Runs crates/capi/tests: programs in C and C++ beside Rust's and Python's. Called by `make test-c`, which has built wheel and library.
set -euo pipefail
cd "$(dirname "$0")/../.."

scripts/install.sh g++ pkg-config cmake make valgrind libopencv-core-dev
scripts/build.sh --bin sdg --example reference
scripts/python/test_venv.sh
# Fixtures and made pictures are those of the Python package's tests.
PYTHONDONTWRITEBYTECODE=1 PYTHONPATH=python/tests target/python/test/bin/pytest -p conftest -p no:cacheprovider -rP crates/capi/tests "$@"
