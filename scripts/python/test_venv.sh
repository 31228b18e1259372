#!/usr/bin/env bash
# A clean environment with the wheel, and what its tests use: target/python/test.
set -euo pipefail
cd "$(dirname "$0")/../.."

scripts/python/venv.sh target/python/test numpy==2.3.5 pytest==9.0.1 mypy==1.18.2
target/python/test/bin/pip install --quiet --disable-pip-version-check --no-deps --force-reinstall target/wheels/single_demo_grasp-*.whl
