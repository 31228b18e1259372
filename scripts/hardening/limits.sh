#!/usr/bin/env bash
# Breaks the robot's limits one by one in a copy of the last commit, and prints the tests that fail for each. A limit that can be broken
# without a failing test is an error. All files are in target/limits.
#
#   ONLY=force   only limits with this word in their name
set -euo pipefail
cd "$(dirname "$0")/../.."

work=$PWD/target/limits
rm -rf "$work/source"
mkdir -p "$work/source"
# -m: files with the times of a commit can be older than programs that cargo built of another commit, and would be kept.
git archive HEAD | tar -x -m -C "$work/source"
cd "$work/source"
export CARGO_TARGET_DIR=$work/build

limits=crates/robot/src/safety/limits.rs
touch=crates/robot/src/touch.rs
# Broken limit | file | sed command that breaks it | tests to run
cases=(
    "none|$limits||test(safety::)"
    "position of joints|$limits|s/\"position\" { 1e-6 }/\"position\" { 1e6 }/|test(safety::)"
    "velocity of joints|$limits|s/dq, &zero, &limits.velocity_max)/dq, \&zero, \&(limits.velocity_max * 9.0))/|test(safety::)"
    "acceleration of joints|$limits|s/ddq, &zero, &limits.acceleration_max)/ddq, \&zero, \&(limits.acceleration_max * 9.0))/|test(safety::)"
    "jerk of joints|$limits|s/&jerk, &zero, &limits.jerk_max)/\&jerk, \&zero, \&(limits.jerk_max * 9.0))/|test(safety::)"
    "velocities near an FR3's ends|$limits|s/dq\[idx\] > max + ROUNDING/dq[idx] > max * 9.0/|test(safety::)"
    "velocity of the tcp|$limits|s/limits.velocity_m_s)/limits.velocity_m_s * 99.0)/|test(safety::)"
    "acceleration of the tcp|$limits|s/limits.acceleration_m_s2)/limits.acceleration_m_s2 * 99.0)/|test(safety::)"
    "jerk of the tcp|$limits|s/limits.jerk_m_s3)/limits.jerk_m_s3 * 999.0)/|test(safety::)"
    "turning of the tcp|$limits|s/limits.angular_velocity_rad_s)/limits.angular_velocity_rad_s * 99.0)/|test(safety::)"
    "workspace|$limits|s/if !(min_m..=max_m).contains(&found_m)/if max_m < min_m/|test(safety::)"
    "table|$limits|s/if found_m < self.min_table_clearance_m/if found_m < -9.0/|test(safety::)"
    "the arm's own bodies|$limits|s/self.min_self_distance_m)/-1.0)/|test(safety::)"
    "torque from cycle to cycle|crates/robot/src/impedance.rs|s/last - max_torque_step_nm, last + max_torque_step_nm/last - 99.0, last + 99.0/|test(impedance::)"
    "force of a contact|$touch|s/self.is_contact = pressed_n >= self.touch_down.contact_n/self.is_contact = pressed_n >= 999.0/|test(touch::)"
    "force of pressing|$touch|s/= self.touch_down.press_n - pressed_n/= 9.0 * self.touch_down.press_n - pressed_n/|test(touch::)"
    "forces that may be told|$touch|s/MAX_FORCE_N: f64 = 15.0/MAX_FORCE_N: f64 = 1500.0/|test(touch::)"
    "force of the hand|crates/robot/src/workcell/file.rs|s/MAX_FORCE_N: f64 = 70.0/MAX_FORCE_N: f64 = 700.0/|test(workcell::)"
    "forces at which a Franka stops|crates/robot/src/franka/mod.rs|s/FREE_FORCE: \[f64; 6\] = .*/FREE_FORCE: [f64; 6] = [900.0; 6];/|test(franka::)"
)

survived=0
printf '| limit | tests that fail |\n|---|---|\n'
for case in "${cases[@]}"; do
    IFS='|' read -r name file change tests <<<"$case"
    [[ "$name" == *"${ONLY:-}"* ]] || continue
    # A filter may itself contain bars.
    tests=${case#*|*|*|}
    cp "$file" "$work/unbroken"
    if [ -n "$change" ]; then
        sed -i "$change" "$file"
        ! cmp -s "$file" "$work/unbroken" || { echo "limits: $name: the change fits no line of $file" >&2; exit 1; }
    fi
    log="$work/$(tr ' ' - <<<"$name").log"
    rc=0
    cargo nextest run --release --locked -p sdg-robot --lib --no-fail-fast -E "$tests" >"$log" 2>&1 || rc=$?
    cp "$work/unbroken" "$file"
    failed=$(sed -n 's/^ *FAIL .*sdg-robot \([^ ]*\)$/`\1`/p' "$log" | sort -u)
    if [ "$name" = none ]; then
        [ $rc -eq 0 ] || { echo "limits: tests fail before anything is broken: $log" >&2; exit 1; }
        continue
    fi
    grep -q 'tests run:' "$log" || { echo "limits: $name: no test was run: $log" >&2; exit 1; }
    [ -n "$failed" ] || survived=$((survived + 1))
    # One row per test.
    sed "1s/^/| $name | /; 2,\$s/^/| | /; s/\$/ |/" <<<"${failed:-none}"
done
[ $survived -eq 0 ] || { echo "limits: $survived can be broken without a failing test" >&2; exit 1; }
