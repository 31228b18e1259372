#!/usr/bin/env bash
# Runs the sections of `make hardening` in SECTIONS, in order. Their results stay in target/hardening, from which a later run of the
# same program, or of the same commit for guards, resumes.
#   input       hostile input for every reader: EXECUTIONS for each of TARGETS (100000, all); figures in TARGET.json, failures in TARGET-NUMBER.bin
#   sync        files are flushed before they get their names, checked by strace
#   coverage    which lines of the readers the input reaches (coverage.sh)
#   guards      each guard is broken once, and the tests that notice it are printed (guards.py)
#   address, thread   tests of some crates under AddressSanitizer and ThreadSanitizer (sanitizers.sh)
# QUICK=1 runs input for two minutes, and sync.
set -euo pipefail
cd "$(dirname "$0")/../.."

seconds=()
if [ -n "${QUICK:-}" ]; then
    SECTIONS="input sync"
    seconds=(--seconds 120)
fi
for section in ${SECTIONS:-input}; do
    echo "== $section"
    case $section in
    input)
        scripts/build.sh --bin hardening
        # shellcheck disable=SC2086 # names of targets
        "${CARGO_TARGET_DIR:-target}/release/hardening" --executions "${EXECUTIONS:-100000}" "${seconds[@]}" ${TARGETS:-}
        ;;
    sync)
        scripts/install.sh strace
        cargo test --release --locked --package sdg-files --lib -- --ignored --exact atomic::tests::a_file_is_flushed_before_it_takes_its_name_and_its_folder_after
        ;;
    coverage) scripts/hardening/coverage.sh ;;
    guards) scripts/hardening/guards.py ;;
    address | thread) scripts/hardening/sanitizers.sh "$section" ;;
    *)
        echo "expected a section input, sync, coverage, guards, address or thread, found $section" >&2
        exit 1
        ;;
    esac
done
