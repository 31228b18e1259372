#!/usr/bin/env bash
# Programs of others against ours: libfranka 0.9.2 (panda-python) drives `sdg simulate --fci`; our client drives franka-sim.
# `make test-peers` runs this; everything is installed below target/peers.
set -euo pipefail
cd "$(dirname "$0")/.."

target=${CARGO_TARGET_DIR:-target}
peers=$target/peers
mkdir -p "$peers"
# franka-sim and panda-python want different versions of numpy: two environments.
install() {
    local environment=$peers/$1
    shift
    [ -x "$environment/bin/python" ] || python3 -m venv "$environment"
    "$environment/bin/pip" install --quiet --disable-pip-version-check "$@"
}
install panda panda-python==1.1.1
install fr3 franka-sim==1.1.7

cargo=${CARGO:-cargo}
$cargo build --release --locked --workspace --bins --example try_views
$cargo build --release --locked -p sdg-fci --example loop_times --example limit_checks
examples=$target/release/examples

# A real robot's program runs with real-time priority; without the right to it, the numbers in real time are this machine's.
realtime=
if chrt -f 30 true 2>/dev/null; then realtime="chrt -f 30"; fi
echo "== real-time priority: ${realtime:-none}"

failed=0
fail() {
    echo "FAIL $1"
    failed=1
}

server=
# Python in the background ignores the interrupt that ends ours.
stop_server() {
    [ -z "$server" ] || kill "-${1:-INT}" "$server" 2>/dev/null || true
    [ -z "$server" ] || wait "$server" 2>/dev/null || true
    server=
}
trap "stop_server TERM" EXIT

# The last argument is the address: each server has its own, so that none waits for another's ports.
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

echo "== libfranka 0.9.2 against our server, in lockstep"
serve 127.0.0.41 --lockstep
"$peers/panda/bin/python" crates/fci/tests/peers/libfranka_v5.py 127.0.0.41 lockstep || fail "libfranka, lockstep"
stop_server
cat "$peers/server.log"
"$peers/panda/bin/python" - "$peers/server.log" <<'PYTHON' || fail "not every command was in its own cycle"
import json, sys
counted = json.loads(open(sys.argv[1]).read().splitlines()[-1])
commands, cycles = counted["commands_in_their_cycle"], counted["motion_cycles"]
print(f"{commands} of {cycles} commands in their own cycle")
sys.exit(not (commands == cycles > 10_000 and counted["commands_late"] == 0))
PYTHON

echo "== libfranka 0.9.2 against our server, in real time"
serve 127.0.0.42
$realtime "$peers/panda/bin/python" crates/fci/tests/peers/libfranka_v5.py 127.0.0.42 realtime || fail "libfranka, real time"
echo "== our client against our server, in real time"
$realtime "$examples/loop_times" 127.0.0.42 60
stop_server
cat "$peers/server.log"

echo "== our client against franka-sim: limits and communication constraints enforced"
mkdir -p "$peers/model"
# Our Panda with heavier motors: the gains of franka-sim, made for another model, let ours overshoot its speed by a tenth.
sed 's/armature="0.1" damping="0.5"/armature="0.3" damping="0.5"/' crates/simulation/assets/panda.xml >"$peers/model/panda.xml"
cat >"$peers/model/fr3.xml" <<'XML'
<mujoco model="fr3"><compiler angle="radian"/><option timestep="0.001"/><include file="panda.xml"/></mujoco>
XML
# Poses within the Cartesian limits need joint accelerations beyond an FR3's; to tell the two apart, those may be larger.
FR3_MJCF=$(realpath "$peers/model/fr3.xml") $realtime "$peers/fr3/bin/run-franka-sim-server" --no-gripper --port 11337 \
    --enforce-comm-constraints --enforce-motion-limits --joint-discontinuity-scale 3 >"$peers/franka-sim.log" 2>&1 &
server=$!
for _ in $(seq 60); do
    grep -q "Server ready" "$peers/franka-sim.log" && break
    sleep 1
done
sleep 2
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
$realtime "$examples/limit_checks" 127.0.0.1:11337 fr3 3 || fail "limits of franka-sim"
stop_server TERM

[ "$failed" = 0 ] && echo "all peers agree"
exit "$failed"
