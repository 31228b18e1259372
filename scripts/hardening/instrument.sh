#!/usr/bin/env bash
# As RUSTC_WORKSPACE_WRAPPER: counts in our own crates alone, since counters in every small function of nalgebra make tests twenty
# times as slow.
exec "$@" -C instrument-coverage
