#!/usr/bin/env bash
# Endurance tests in sections; crash resumes an earlier run, soak and robot stop at a time limit. docs/testing.md has the figures.
#
#   endure.sh [SECTION…]   crash, refusals, soak, robot, flakey, limits, mutants; without a section, the first four
#   QUICK=1                only a few repetitions of each
#   KILLS, FRAMES, SESSIONS, DISCONNECTIONS, ATTEMPTS   numbers of repetitions; SECS: maximum time of a part of soak or robot
set -euo pipefail
cd "$(dirname "$0")/../.."

if [ -n "${QUICK:-}" ]; then
    kills=5 frames=500 sessions=30 disconnections=50 attempts=6 secs=120
else
    kills=200 frames=100000 sessions=500 disconnections=1000 attempts=1000 secs=36000
fi
kills=${KILLS:-$kills} frames=${FRAMES:-$frames} sessions=${SESSIONS:-$sessions} secs=${SECS:-$secs}
disconnections=${DISCONNECTIONS:-$disconnections} attempts=${ATTEMPTS:-$attempts}
sections=("$@")
[ ${#sections[@]} -gt 0 ] || sections=(crash refusals soak robot)

scripts/build.sh --bin sdg --bin endurance
programs=${CARGO_TARGET_DIR:-target}/release
failed=()
try() { "$@" || failed+=("$*"); }
endurance() { try "$programs/endurance" --sdg "$programs/sdg" "$@"; }
for section in "${sections[@]}"; do
    case $section in
        crash) endurance crash --kills "$kills" ;;
        refusals)
            scripts/install.sh libfaketime python3
            endurance refusals
            ;;
        soak)
            mkdir -p target/endurance
            cc -O2 -shared -fPIC -o target/endurance/heap.so scripts/hardening/heap.c
            endurance frames --frames "$frames" --max-secs "$secs"
            endurance frames --frames $((frames / 10)) --every-frame --max-secs "$secs"
            endurance frames --model C --frames $((frames / 5)) --every-frame --max-secs "$secs"
            endurance frames --frames $((disconnections + 1)) --frames-a-connection 1 --max-secs "$secs"
            endurance page --sessions "$sessions" --max-secs "$secs"
            ;;
        robot)
            scripts/build.sh --example endured_attempts
            try "$programs/examples/endured_attempts" "$attempts" 0 "$secs"
            ;;
        flakey) try scripts/hardening/flakey.sh $(((kills + 9) / 10)) ;;
        limits) try scripts/hardening/limits.sh ;;
        mutants) try scripts/hardening/mutants.sh ;;
        *) echo "endure: expected crash, refusals, soak, robot, flakey, limits or mutants, found $section" >&2; exit 2 ;;
    esac
done
[ ${#failed[@]} -eq 0 ] || { printf 'endure: failed: %s\n' "${failed[@]}" >&2; exit 1; }
