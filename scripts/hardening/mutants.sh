#!/usr/bin/env bash
# Mutants of crate robot's safety, crate kinematics' timing and crate fci, each with the tests of its own crate only: those of other
# crates would catch more but take hours. The results are in target/mutants/NAME/mutants.out.
#
#   mutants.sh [NAME…]    safety, timing, fci; without a name, all
#   SHARD=0/8             every eighth mutant
set -euo pipefail
cd "$(dirname "$0")/../.."

# cargo-mutants builds copies of the workspace, each in its own target folder.
unset CARGO_TARGET_DIR
command -v cargo-mutants >/dev/null || cargo install cargo-mutants --locked
names=("$@")
[ ${#names[@]} -gt 0 ] || names=(safety timing fci)

for name in "${names[@]}"; do
    case $name in
        safety) files='crates/robot/src/safety/**' tests=(--lib -E 'test(safety::)') ;;
        timing) files='crates/kinematics/src/timing/**' tests=(--lib -E 'test(timing::)') ;;
        fci) files='crates/fci/src/**' tests=(--lib --tests) ;;
        *) echo "mutants: expected safety, timing or fci, found $name" >&2; exit 2 ;;
    esac
    out=$PWD/target/mutants/$name
    mkdir -p "$out"
    # Exit code 2 means that some mutants survived, which are counted below.
    cargo mutants -f "$files" ${SHARD:+--shard "$SHARD" --sharding round-robin} --profile release --timeout 60 --build-timeout 600 \
        --test-tool nextest --cargo-arg=--locked -o "$out" -- "${tests[@]}" || [ $? -le 3 ]
    count() { wc -l <"$out/mutants.out/$1.txt"; }
    caught=$(($(count caught) + $(count timeout)))
    viable=$((caught + $(count missed)))
    echo "$name: $caught of $viable caught ($(count timeout) by time), $(count unviable) do not compile; survivors:"
    sed 's/^/  /' "$out/mutants.out/missed.txt"
done
