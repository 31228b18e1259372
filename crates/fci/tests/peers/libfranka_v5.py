"""Unmodified libfranka 0.9.2 (panda-python) drives this project's server: python libfranka_v5.py HOST lockstep|realtime.

Prints a line for each check. In lockstep every command must be answered in its own cycle; in real time the
fraction is reported, and motions for which this machine is too slow do not fail the run.
"""

import math
import sys

from panda_py import libfranka

HOST, PACE = sys.argv[1], sys.argv[2]
LOCKSTEP = PACE == "lockstep"
STIFF = libfranka.ControllerMode.kJointImpedance
SOFT = libfranka.ControllerMode.kCartesianImpedance

failed = 0
num_calls = num_in_cycle = 0


def check(name, is_right, found=""):
    global failed
    failed += not is_right
    print(f"{'ok  ' if is_right else 'FAIL'} {name} {found}", flush=True)


class Clock:
    """Robot time since the motion's first callback, and the number of callbacks that followed the last one by a millisecond."""

    def __init__(self):
        self.secs, self.calls, self.in_cycle, self.rates = 0.0, 0, 0, []

    def tick(self, state, step):
        global num_calls, num_in_cycle
        self.secs += step.to_sec()
        self.calls += 1
        in_cycle = self.calls == 1 or step.to_msec() == 1
        num_calls, num_in_cycle = num_calls + 1, num_in_cycle + in_cycle
        self.in_cycle += in_cycle
        if self.calls > 1:
            self.rates.append(state.control_command_success_rate)


def swing(duration):
    """A value from 0 to 1 and back in duration seconds, at rest at both ends."""
    return lambda t: 0.5 * (1.0 - math.cos(2.0 * math.pi * min(t / duration, 1.0)))


def run(name, control, command, duration, **options):
    """Runs a motion with the commands of command(state, secs); returns its clock.

    In real time, a motion may be stopped because commands were lost: after twenty in a row, or because the first command after a gap
    violates a limit.
    """
    clock = Clock()
    if not LOCKSTEP and robot.read_once().robot_mode == libfranka.RobotMode.kReflex:
        robot.automatic_error_recovery()

    def callback(state, step):
        clock.tick(state, step)
        answer = command(state, clock.secs)
        answer.motion_finished = clock.secs >= duration
        return answer

    try:
        control(callback, **options)
        error = None
    except Exception as exception:  # libfranka's own classes are not exported
        error = str(exception).replace("\n", " ")
    rate = min(clock.rates, default=0.0)
    if LOCKSTEP:
        is_right = error is None and clock.calls == clock.in_cycle and rate == 1.0
    else:
        was_late = clock.calls > clock.in_cycle or rate < 1.0
        is_right = error is None or (was_late and ("communication_constraints_violation" in error or "discontinuity" in error))
    check(name, is_right, f"{clock.calls} commands, {clock.in_cycle} in their own cycle, lowest rate {rate:.2f}"
          + (f"; {error}" if error else ""))
    return clock


robot = libfranka.Robot(HOST, libfranka.RealtimeConfig.kIgnore)


def main():
    check("version", robot.server_version() == 5, robot.server_version())
    hand = libfranka.Gripper(HOST)
    check("hand's version", hand.server_version() == 3, hand.server_version())

    # Setters, and values that a robot rejects.
    robot.set_collision_behavior([30.0] * 7, [40.0] * 7, [30.0] * 6, [40.0] * 6)
    robot.set_joint_impedance([3000.0, 3000.0, 3000.0, 2500.0, 2500.0, 2000.0, 2000.0])
    robot.set_cartesian_impedance([2000.0] * 3 + [100.0] * 3)
    robot.set_load(0.1, [0.0, 0.0, 0.1], [1e-4, 0, 0, 0, 1e-4, 0, 0, 0, 1e-4])
    check("load", abs(robot.read_once().m_load - 0.1) < 1e-12)
    robot.set_load(0.0, [0.0] * 3, [0.0] * 9)
    try:
        robot.set_load(-1.0, [0.0] * 3, [0.0] * 9)
        check("a negative load is refused", False)
    except Exception as exception:
        check("a negative load is refused", True, exception)

    shape = swing(2.0)

    # Joint positions, with each internal controller; the arm must follow within 0.01 rad.
    for label, mode in [("joint impedance", STIFF), ("Cartesian impedance", SOFT)]:
        start = robot.read_once().q_d
        largest = [0.0]

        def joints(state, t, start=start, largest=largest):
            q = list(start)
            q[0] += 0.3 * shape(t)
            q[3] += 0.2 * shape(t)
            largest[0] = max(largest[0], max(abs(a - b) for a, b in zip(state.q, state.q_d)))
            return libfranka.JointPositions(q)

        run(f"joint positions, {label}", robot.control_joint_position, joints, 2.0, controller_mode=mode)
        check(f"  follows within 0.01 rad ({label})", largest[0] < 0.01, f"{largest[0]:.5f}")

    def velocities(state, t):
        return libfranka.JointVelocities([0.0] * 5 + [0.3 * math.sin(math.pi * min(t / 2.0, 1.0) * 2.0), 0.0])

    run("joint velocities", robot.control_joint_velocity, velocities, 2.0, controller_mode=STIFF)

    # Poses: 6 cm to the side and back.
    start = robot.read_once().O_T_EE_c
    reached = [0.0]

    def poses(state, t):
        pose = list(start)
        pose[13] += 0.06 * shape(t)
        reached[0] = max(reached[0], state.O_T_EE[13] - start[13])
        return libfranka.CartesianPose(pose)

    run("poses", robot.control_cartesian_pose, poses, 2.0, controller_mode=STIFF)
    check("  reaches 0.06 m", abs(reached[0] - 0.06) < 0.003, f"{reached[0]:.4f}")

    elbow = robot.read_once().elbow_c

    def poses_with_elbow(state, t):
        return libfranka.CartesianPose(list(start), [elbow[0] + 0.1 * shape(t), elbow[1]])

    run("poses with elbow", robot.control_cartesian_pose, poses_with_elbow, 2.0, controller_mode=STIFF)

    def twists(state, t):
        return libfranka.CartesianVelocities([0.0, 0.0, 0.05 * math.sin(math.pi * min(t, 2.0)), 0.0, 0.0, 0.0])

    run("twists", robot.control_cartesian_velocity, twists, 2.0, controller_mode=STIFF)

    # Torques of springs move joint 6 and hold the others; the robot adds gravity compensation.
    start = robot.read_once().q

    def torques(state, t):
        goal = list(start)
        goal[5] += 0.1 * shape(t)
        return libfranka.Torques([100.0 * (g - q) - 10.0 * dq for g, q, dq in zip(goal, state.q, state.dq)])

    run("torques", robot.control, torques, 2.0)

    def joints_and_torques():
        goal = robot.read_once().q_d
        return run(
            "joint positions with own torques",
            lambda callback: robot.control_torque_joint_position(
                lambda state, step: libfranka.Torques([200.0 * (a - b) - 20.0 * c for a, b, c in zip(state.q_d, state.q, state.dq)]),
                callback,
            ),
            lambda state, t: libfranka.JointPositions([g + (0.1 * shape(t) if i == 6 else 0.0) for i, g in enumerate(goal)]),
            2.0,
        )

    joints_and_torques()

    # A jump of the command stops the robot; then the recovery.
    def jump(state, t):
        q = list(state.q_d)
        q[0] += 1.0 if t > 0.1 else 0.0
        return libfranka.JointPositions(q)

    try:
        clock = Clock()

        def callback(state, step):
            clock.tick(state, step)
            return jump(state, clock.secs)

        robot.control_joint_position(callback, controller_mode=STIFF, limit_rate=False, cutoff_frequency=1000.0)
        check("a jump of 1 rad stops the robot", False)
    except Exception as exception:
        text = str(exception).replace("\n", " ")
        check("a jump of 1 rad stops the robot", "joint_motion_generator_velocity_discontinuity" in text, text)
    state = robot.read_once()
    check("  the robot waits in reflex", state.robot_mode == libfranka.RobotMode.kReflex, state.robot_mode)
    try:
        robot.control_joint_position(lambda state, step: libfranka.JointPositions(state.q_d), controller_mode=STIFF)
        check("  no motion starts", False)
    except Exception as exception:
        check("  no motion starts", True, exception)
    robot.automatic_error_recovery()
    check("  recovered", robot.read_once().robot_mode == libfranka.RobotMode.kIdle)

    # Presses on the table: a reflex by external force.
    robot.set_collision_behavior([5.0] * 7, [8.0] * 7, [5.0] * 6, [8.0] * 6)

    def down(state, t):
        return libfranka.CartesianVelocities([0.0, 0.0, -0.1 * min(t / 0.5, 1.0), 0.0, 0.0, 0.0])

    clock = Clock()

    def callback(state, step):
        clock.tick(state, step)
        return down(state, clock.secs)

    try:
        robot.control_cartesian_velocity(callback, controller_mode=STIFF)
        check("the table stops the robot", False)
    except Exception as exception:
        text = str(exception).replace("\n", " ")
        is_slow = not LOCKSTEP and "communication_constraints_violation" in text
        check("the table stops the robot", "reflex" in text and ("_reflex" in text or is_slow), text)
    robot.automatic_error_recovery()
    robot.set_collision_behavior([50.0] * 7, [60.0] * 7, [50.0] * 6, [60.0] * 6)
    run("up again", robot.control_cartesian_velocity,
        lambda state, t: libfranka.CartesianVelocities([0.0, 0.0, 0.1 * math.sin(math.pi * min(t / 2.0, 1.0)), 0.0, 0.0, 0.0]),
        2.0, controller_mode=STIFF)

    # Exceptions in a callback stop the motion by StopMove.
    def broken(state, step):
        raise ValueError("broken")

    try:
        robot.control_joint_position(broken, controller_mode=STIFF)
        check("a broken callback ends the motion", False)
    except Exception as exception:
        check("a broken callback ends the motion", "broken" in str(exception), type(exception).__name__)
    check("  idle again", robot.read_once().robot_mode == libfranka.RobotMode.kIdle)

    # A long motion: 10,000 commands.
    run("joint positions for 10 s", robot.control_joint_position,
        lambda state, t, start=robot.read_once().q_d: libfranka.JointPositions(
            [q + (0.3 * swing(5.0)(t % 5.0) if i == 1 else 0.0) for i, q in enumerate(start)]),
        10.0, controller_mode=STIFF)

    # The hand.
    check("homing", hand.homing())
    check("  open", abs(hand.read_once().width - 0.08) < 0.001, f"{hand.read_once().width:.4f}")
    check("hand moves to 3 cm", hand.move(0.03, 0.1) and abs(hand.read_once().width - 0.03) < 0.0015,
          f"{hand.read_once().width:.4f}")
    check("a grasp without a part is unsuccessful", not hand.grasp(0.03, 0.05, 20.0))
    check("  no part is held", not hand.read_once().is_grasped)
    check("hand opens", hand.move(0.08, 0.1))
    try:
        hand.move(0.5, 0.1)
        check("a width of 0.5 m is refused", False)
    except Exception as exception:
        check("a width of 0.5 m is refused", True, exception)
    check("hand stops", hand.stop())

    print(f"{num_calls} callbacks, {num_in_cycle} a millisecond after the last")
    return failed


sys.exit(1 if main() else 0)
