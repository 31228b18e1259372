#!/usr/bin/env bash
# Runs crates/capi/tests, which compare programs in C and C++ with Rust and Python. Called by `make test-c`, which builds wheel and library first.
set -euo pipefail
cd "$(dirname "$0")/../.."

scripts/install.sh g++ pkg-config cmake make valgrind libopencv-core-dev
scripts/build.sh --bin sdg --example reference
scripts/python/test_venv.sh
# The fixtures and test pictures are those of the Python package's tests.
PYTHONDONTWRITEBYTECODE=1 PYTHONPATH=python/tests target/python/test/bin/pytest -p conftest -p no:cacheprovider -rP crates/capi/tests "$@"
