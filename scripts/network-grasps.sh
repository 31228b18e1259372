#!/usr/bin/env bash
# Complete grasps of every shipped part over TCP and UDP, in lockstep and in real time: NETWORK_GRASPS (20) attempts each, compared
# with the same attempts in one process. The example defines a failure.
set -euo pipefail
cd "$(dirname "$0")/.."

attempts=${NETWORK_GRASPS:-20}
scripts/build.sh --example network_grasps
example=${CARGO_TARGET_DIR:-target}/release/examples/network_grasps

modes=${NETWORK_MODES:-lockstep realtime}

# A real robot's program runs with real-time priority; without that permission, the real-time numbers depend on this machine's load.
realtime=
if chrt -f 30 true 2>/dev/null; then realtime="chrt -f 30"; fi

for mode in $modes; do
    case $mode in
    lockstep)
        echo "== in lockstep"
        "$example" lockstep "$attempts"
        ;;
    realtime)
        echo "== in real time, real-time priority: ${realtime:-none}"
        $realtime "$example" realtime "$attempts"
        ;;
    *)
        echo "network-grasps: NETWORK_MODES: expected lockstep or realtime, found $mode" >&2
        exit 2
        ;;
    esac
done
