#!/usr/bin/env bash
# Measures the fraction of the readers' lines that hostile input reaches: `make hardening COVERAGE=1`. At most EXECUTIONS of each target (20000), in
# COVERAGE_SECONDS for all targets together (400).
# The first table is per reader, the second per file; `SHOW=FILE` prints a file's lines with their counts.
set -euo pipefail
cd "$(dirname "$0")/../.."

host=$(rustc -vV | sed -n 's/^host: //p')
tools=$(rustc --print sysroot)/lib/rustlib/$host/bin
[ -x "$tools/llvm-cov" ] || rustup component add llvm-tools || {
    echo "expected llvm-cov of this compiler's version ($(rustc -vV | sed -n 's/^LLVM version: //p')), found none: rustup component add llvm-tools" >&2
    exit 1
}

out=target/hardening/coverage
mkdir -p "$out/figures"
# Programs of the build also write counts.
LLVM_PROFILE_FILE="$PWD/$out/build-%p.profraw" RUSTC_WORKSPACE_WRAPPER="$PWD/scripts/hardening/instrument.sh" \
    scripts/build.sh --bin hardening
cp "${CARGO_TARGET_DIR:-target}/release/hardening" "$out/hardening"
# Restores the program without counters.
scripts/build.sh --bin hardening

if [ -z "${SHOW:-}" ]; then
    rm -f "$out"/*.profraw "$out"/figures/*
    # Counters make the program many times slower, so failures, such as executions that take too long, do not end this script.
    # shellcheck disable=SC2086 # names of targets
    LLVM_PROFILE_FILE="$PWD/$out/%p.profraw" "$out/hardening" --executions "${EXECUTIONS:-20000}" --seconds "${COVERAGE_SECONDS:-400}" \
        --out "$out/figures" ${TARGETS:-} || echo "coverage: there are failures, listed above"
    "$tools/llvm-profdata" merge --sparse "$out"/*.profraw --output "$out/all.profdata"
    "$tools/llvm-cov" export "$out/hardening" --instr-profile "$out/all.profdata" --summary-only >"$out/summary.json"
    python3 scripts/hardening/coverage_tables.py "$out/summary.json"
else
    "$tools/llvm-cov" show "$out/hardening" --instr-profile "$out/all.profdata" "$SHOW"
fi
