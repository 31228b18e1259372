#!/usr/bin/env bash
# The compiler with line counters for crates of this workspace, called by cargo as RUSTC_WORKSPACE_WRAPPER, so burn is not compiled again.
exec "$@" -C instrument-coverage
