#!/usr/bin/env bash
# Makes a clean environment with the wheel and the packages of its tests: target/python/test.
set -euo pipefail
cd "$(dirname "$0")/../.."

scripts/python/venv.sh target/python/test numpy==2.4.6 pytest==9.2.0 mypy==2.4.1
target/python/test/bin/pip install --quiet --disable-pip-version-check --no-deps --force-reinstall target/wheels/single_demo_grasp-*.whl
