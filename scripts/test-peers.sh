#!/usr/bin/env bash
# Tests our programs against other software: libfranka 0.9.2 (panda-python) drives `sdg simulate --fci`; our client drives franka-sim.
# `make test-peers` runs this; everything is installed below target/peers. test-peers.sh [lockstep|realtime|franka-sim|checks]…
# or PEERS="lockstep checks" runs only these parts.
set -euo pipefail
cd "$(dirname "$0")/.."

target=${CARGO_TARGET_DIR:-target}
peers=$target/peers
mkdir -p "$peers"
# franka-sim and panda-python need different versions of numpy, so each has its own environment.
scripts/python/venv.sh "$peers/panda" panda-python==1.1.1
scripts/python/venv.sh "$peers/fr3" franka-sim==1.1.7
scripts/python/venv.sh "$peers/v10" pylibfranka==0.21.3

scripts/build.sh --bin sdg --example hand_checks --example limit_checks --example loop_times
examples=$target/release/examples

# A real robot's program runs with real-time priority; without that permission, the real-time numbers depend on this machine's load.
realtime=
if chrt -f 30 true 2>/dev/null; then realtime="chrt -f 30"; fi
echo "== real-time priority: ${realtime:-none}"

parts=${*:-${PEERS:-lockstep realtime franka-sim checks}}
for part in $parts; do
    case $part in lockstep | realtime | franka-sim | checks) ;; *) echo "expected lockstep, realtime, franka-sim or checks, found $part" && exit 2 ;; esac
done
runs() { [[ " $parts " == *" $1 "* ]]; }

failed=0
fail() {
    echo "FAIL $1"
    failed=1
}

server=
# The argument TERM ends Python, which ignores interrupts in the background; our server ends by an interrupt.
stop_server() {
    [ -z "$server" ] || kill "-${1:-INT}" "$server" 2>/dev/null || true
    [ -z "$server" ] || wait "$server" 2>/dev/null || true
    server=
}
trap "stop_server TERM" EXIT

# The first argument is the address: each server has its own, so none waits for the ports of another server.
serve() {
    local address=$1
    shift
    $realtime "$target/release/sdg" simulate --fci --json --address "$address" "$@" >"$peers/server.log" &
    server=$!
    for _ in $(seq 100); do
        grep -q robot "$peers/server.log" && return
        sleep 0.1
    done
    echo "sdg simulate did not start"
    exit 1
}

in_lockstep() {
    echo "== libfranka 0.9.2 against our server, in lockstep"
    serve 127.0.0.41 --lockstep
    "$peers/panda/bin/python" crates/fci/tests/peers/libfranka_v5.py 127.0.0.41 lockstep || fail "libfranka, lockstep"
    "$peers/v10/bin/python" crates/fci/tests/peers/libfranka_v10.py 127.0.0.41 || fail "pylibfranka"
    "$examples/hand_checks" 127.0.0.41 || fail "our client against our hand"
    stop_server
    cat "$peers/server.log"
    "$peers/panda/bin/python" - "$peers/server.log" <<'PYTHON' || fail "not every command was in its own cycle"
import json, sys
counted = json.loads(open(sys.argv[1]).read().splitlines()[-1])
commands, cycles = counted["commands_in_their_cycle"], counted["motion_cycles"]
print(f"{commands} of {cycles} commands in their own cycle")
sys.exit(not (commands == cycles > 10_000 and counted["commands_late"] == 0))
PYTHON
}

in_real_time() {
    echo "== libfranka 0.9.2 against our server, in real time"
    serve 127.0.0.42
    $realtime "$peers/panda/bin/python" crates/fci/tests/peers/libfranka_v5.py 127.0.0.42 realtime || fail "libfranka, real time"
    echo "== our client against our server, in real time"
    $realtime "$examples/loop_times" 127.0.0.42 60
    stop_server
    cat "$peers/server.log"
}

# Further arguments are passed to franka-sim.
serve_franka_sim() {
    mkdir -p "$peers/model"
    : >"$peers/franka-sim.log"
    "$peers/fr3/bin/python" scripts/franka_sim_model.py crates/simulation/assets/panda.xml "$peers/model"
    FR3_MJCF=$(realpath "$peers/model/fr3.xml") $realtime "$peers/fr3/bin/run-franka-sim-server" --port 11337 \
        --enforce-comm-constraints --enforce-motion-limits "$@" >"$peers/franka-sim.log" 2>&1 &
    server=$!
    for _ in $(seq 60); do
        grep -q "Server ready" "$peers/franka-sim.log" && break
        sleep 1
    done
    sleep 2
}

over_franka_sim() {
    echo "== our client against franka-sim: limits and communication constraints enforced"
    # The hand of franka-sim is always on port 1338, with an object of 30 mm between the fingers.
    serve_franka_sim --gripper-object-width 0.03
    "$examples/hand_checks" 127.0.0.1 30 || fail "hand of franka-sim"
    : >"$peers/rates.txt"
    for _ in $(seq 10); do
        $realtime "$examples/loop_times" 127.0.0.1:11337 10 | tee -a "$peers/rates.txt" || true
        sleep 1
    done
    "$peers/fr3/bin/python" - "$peers/rates.txt" <<'PYTHON' || fail "fewer than 8 of 10 runs with a success rate of 0.99"
import json, sys
runs = [json.loads(line) for line in open(sys.argv[1])]
good = [run for run in runs if run["error"] is None and run["mean_rate"] >= 0.99]
print(f"{len(good)} of {len(runs)} runs of 10 s with a mean control_command_success_rate of at least 0.99")
for run in runs:
    if run not in good:
        print(f"  failed: {run['stalls_over_20_ms']} stalls over 20 ms, the longest {run['max_gap_ms']} ms: {run['error']}")
sys.exit(len(good) < 8)
PYTHON
    stop_server TERM
}

checks_of_franka_sim() {
    echo "== every check of franka-sim, one motion just inside and one just outside"
    # Poses within the Cartesian limits need joint accelerations beyond an FR3's; these may be larger here, to test the limits separately.
    serve_franka_sim --no-gripper --joint-discontinuity-scale 3
    $realtime "$examples/limit_checks" 127.0.0.1:11337 fr3 3 || fail "limits of franka-sim"
    stop_server TERM
    serve_franka_sim --no-gripper
    $realtime "$examples/limit_checks" 127.0.0.1:11337 fr3 3 joints || fail "limits of franka-sim's joints in Cartesian motions"
    stop_server TERM
}

if runs lockstep; then in_lockstep; fi
if runs realtime; then in_real_time; fi
if runs franka-sim; then over_franka_sim; fi
if runs checks; then checks_of_franka_sim; fi

[ "$failed" = 0 ] && echo "all peers agree"
exit "$failed"
