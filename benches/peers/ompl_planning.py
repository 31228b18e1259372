"""OMPL's RRT-Connect on the problems of `planning proof`, with our collision model: success, number of collision checks, and whether its paths
are free between the checked configurations.

    python ompl_planning.py PLANNING_PROGRAM [COUNT] [FIRST_SEED] [SEGMENT_FRACTION]

PLANNING_PROGRAM is target/release/examples/planning; its `serve` answers each check. SEGMENT_FRACTION is OMPL's longest valid segment as a fraction of
the space's extent: 0.005 in MoveIt's configuration of the Panda, 0.01 as OMPL's default.
"""

import math
import struct
import subprocess
import sys

from ompl import base, geometric, util

# As in crates/kinematics/src/arms/panda.rs.
LOW = [-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973]
HIGH = [2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973]
SOLVE_SECS = 10.0
# Step in rad at which a path is checked afterwards.
FINE_RAD = 0.003


class Model:
    """The collision model, which our program runs."""

    def __init__(self, program):
        self.process = subprocess.Popen([program, "serve"], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.checks = 0

    def open(self, seed):
        self._send(struct.pack("<Q", seed))
        numbers = struct.unpack("<14d", self._receive(14 * 8))
        self.checks = 0
        return numbers[:7], numbers[7:]

    def is_free(self, q):
        self.checks += 1
        self._send(struct.pack("<7d", *q))
        return self._receive(1) == b"\1"

    def close_problem(self):
        self._send(struct.pack("<7d", *[math.nan] * 7))

    def end(self):
        self._send(struct.pack("<Q", 2**64 - 1))
        self.process.wait()

    def _send(self, data):
        self.process.stdin.write(data)
        self.process.stdin.flush()

    def _receive(self, count):
        data = self.process.stdout.read(count)
        if len(data) != count:
            raise SystemExit(f"the planning program ended: expected {count} bytes, found {len(data)}")
        return data


def solve(model, seed, fraction):
    start, goal = model.open(seed)
    space = base.RealVectorStateSpace(7)
    bounds = base.RealVectorBounds(7)
    for joint in range(7):
        bounds.setLow(joint, LOW[joint])
        bounds.setHigh(joint, HIGH[joint])
    space.setBounds(bounds)
    space.setLongestValidSegmentFraction(fraction)
    setup = geometric.SimpleSetup(space)
    setup.setStateValidityChecker(lambda state: model.is_free([state[joint] for joint in range(7)]))
    information = setup.getSpaceInformation()
    states = []
    for q in (start, goal):
        state = space.allocState()
        for joint in range(7):
            state[joint] = q[joint]
        states.append(state)
    setup.setStartAndGoalStates(states[0], states[1])
    setup.setPlanner(geometric.RRTConnect(information))
    setup.solve(SOLVE_SECS)
    checks = model.checks
    if not setup.haveExactSolutionPath():
        model.close_problem()
        return None, checks, False
    path = setup.getSolutionPath()
    way = [[state[joint] for joint in range(7)] for state in path.getStates()]
    touches = False
    for a, b in zip(way, way[1:]):
        steps = max(1, math.ceil(math.dist(a, b) / FINE_RAD))
        for i in range(steps + 1):
            q = [u + (v - u) * i / steps for u, v in zip(a, b)]
            if not model.is_free(q):
                touches = True
                break
        if touches:
            break
    model.close_problem()
    return way, checks, touches


def main():
    program = sys.argv[1]
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 100
    first = int(sys.argv[3]) if len(sys.argv) > 3 else 0
    fraction = float(sys.argv[4]) if len(sys.argv) > 4 else 0.005
    util.setLogLevel(util.LogLevel.LOG_ERROR if hasattr(util, "LogLevel") else util.LOG_ERROR)
    util.RNG.setSeed(1)
    model = Model(program)
    all_checks, failed, touching = [], [], []
    for seed in range(first, first + count):
        way, checks, touches = solve(model, seed, fraction)
        if way is None:
            failed.append(seed)
            continue
        all_checks.append(checks)
        if touches:
            touching.append(seed)
    model.end()
    all_checks.sort()
    print(f"OMPL RRTConnect, longest valid segment {fraction}: {len(all_checks)} of {count} found, not found: {failed}")
    if all_checks:
        median, p99 = all_checks[len(all_checks) // 2], all_checks[round((len(all_checks) - 1) * 0.99)]
        print(f"checks before simplifying: median {median}, 99 % {p99}, most {all_checks[-1]}, mean {sum(all_checks) / len(all_checks):.0f}")
    print(f"paths nearer than the margin between checked configurations: {len(touching)} of {len(all_checks)}")


if __name__ == "__main__":
    main()
