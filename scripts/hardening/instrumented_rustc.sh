#!/usr/bin/env bash
# The compiler for crates of this workspace, with counters of lines: what cargo calls as RUSTC_WORKSPACE_WRAPPER, so that burn is not compiled again.
exec "$@" -C instrument-coverage
