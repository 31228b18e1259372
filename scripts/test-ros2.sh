#!/usr/bin/env bash
# Tests our ROS 2 code against other implementations on the loopback interface: Cyclone DDS (PyPI), Fast DDS (Debian) and rosbags' bytes.
# `make test-ros2` runs this; everything is installed below target/ros2. TESTS="pictures latency" runs only these.
set -euo pipefail
cd "$(dirname "$0")/.."

target=${CARGO_TARGET_DIR:-target}
peers=$target/ros2
mkdir -p "$peers"
scripts/install.sh libfastrtps-dev g++
scripts/python/venv.sh "$peers/venv" cyclonedds==11.0.1 rosbags==0.11.9 pillow
source=crates/ros2/tests/peers
if [ ! -x "$peers/fast_peer" ] || [ "$source/fast_peer.cpp" -nt "$peers/fast_peer" ]; then
    g++ -O1 -std=c++17 "$source/fast_peer.cpp" -o "$peers/fast_peer" -lfastrtps -lfastcdr
fi

# The whole workspace with the feature: burn is compiled once more, because some of its dependencies then have other features.
scripts/build.sh --bin sdg --features sdg-cli/ros2 --example cdr_round_trip --example arm_against_peer --example ros2_cell
examples=$target/release/examples

failed=0
fail() {
    echo "FAIL $1"
    failed=1
}

python=$peers/venv/bin/python
tests=${TESTS:-bytes arm pictures services faults latency memory fast}
if [ -z "${TESTS:-}" ]; then
    # It records packets on the loopback interface.
    if [ "$(id -u)" = 0 ]; then
        tests="$tests attack"
    else
        echo "attack is left out: it needs root; TESTS=attack runs it alone"
    fi
fi
for name in $tests; do
    case $name in
    bytes)
        echo "== bytes of rosbags"
        "$python" $source/message_bytes.py "$examples/cdr_round_trip" || fail bytes
        ;;
    arm)
        echo "== an arm behind actions, over Cyclone DDS"
        "$python" $source/arm_peer.py "$examples/arm_against_peer" || fail arm
        ;;
    attack)
        echo "== mutated packets"
        "$python" $source/rtps_attack.py "$target/release/sdg" "$peers/models" "${PACKETS:-100000}" || fail attack
        ;;
    fast)
        echo "== Fast DDS"
        "$python" $source/fast_tests.py "$target/release/sdg" "$peers/models" "$peers/fast_peer" || fail "Fast DDS"
        ;;
    *) "$python" $source/node_tests.py "$target/release/sdg" "$peers/models" "$name" || fail "$name" ;;
    esac
done

[ "$failed" = 0 ] && echo "all peers agree"
exit "$failed"
