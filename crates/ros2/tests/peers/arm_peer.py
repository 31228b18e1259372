"""Plays an arm's driver over Cyclone DDS: all endpoints of FollowJointTrajectory and GripperCommand, and joint_states.

python arm_peer.py PROGRAM: the built example arm_against_peer, whose lines are compared with the expected ones.
"""

import subprocess
import sys
import threading
import time

import numpy as np
from cyclone import Peer, Server, best_effort, header, make, pack, reliable, stamp_now, transient_local, unpack

DOMAIN = 47
READY = [0.0, -0.785398, 0.0, -2.356194, 0.0, 1.570796, 0.785398]
JOINTS = [f"panda_joint{joint}" for joint in range(1, 8)]
FINGERS = ["panda_finger_joint1", "panda_finger_joint2"]
SUCCEEDED, CANCELED, ABORTED = 4, 5, 6
UNKNOWN_GOAL, GOAL_TERMINATED = 2, 3
done = []


class Action:
    """The five endpoints of an action."""

    def __init__(self, peer, action, name):
        at, participant = action + "/_action", peer.participant
        self.goals = Server(participant, at + "/send_goal", "control_msgs", name + "_SendGoal", "action")
        self.cancels = Server(participant, at + "/cancel_goal", "action_msgs", "CancelGoal", "srv")
        self.results = Server(participant, at + "/get_result", "control_msgs", name + "_GetResult", "action")
        self.feedback = peer.writer(at + "/feedback", f"control_msgs/action/{name}_FeedbackMessage", reliable(10))
        self.status = peer.writer(at + "/status", "action_msgs/msg/GoalStatusArray", transient_local(1))
        self.asked, self.ended = [], {}
        # A goal that runs until it is cancelled, and its result.
        self.running, self.running_result = None, b""

    def accept(self, head, accepted):
        stamp = stamp_now()
        self.goals.answer(head, bytes([accepted, 0, 0, 0]) + stamp.sec.to_bytes(4, "little") + stamp.nanosec.to_bytes(4, "little"))

    def tell(self, goal, status):
        self.status((1).to_bytes(4, "little") + goal + bytes(8) + bytes([status]))

    def end(self, goal, status, result):
        """Ends a goal. The status is one byte, so `result` begins with padding for its alignment."""
        self.tell(goal, status)
        self.ended[goal] = bytes([status]) + result
        self.serve()

    def serve(self):
        """Answers requests for the results of ended goals, and cancellations, which end the goal `running`."""
        self.asked += [(content[:16], head) for head, content in self.results.requests()]
        for goal, head in self.asked:
            if goal in self.ended:
                self.results.answer(head, self.ended[goal])
        self.asked = [(goal, head) for goal, head in self.asked if goal not in self.ended]
        if self.cancelled(self.running):
            goal, self.running = self.running, None
            self.end(goal, CANCELED, self.running_result)

    def cancelled(self, running):
        """Whether the running goal is cancelled."""
        found = False
        for head, content in self.cancels.requests():
            goal = content[:16]
            if goal == running:
                self.cancels.answer(head, bytes([0, 0, 0, 0]) + (1).to_bytes(4, "little") + goal + bytes(8))
                done.append("cancel")
                found = True
            else:
                code = GOAL_TERMINATED if goal in self.ended else UNKNOWN_GOAL
                self.cancels.answer(head, bytes([code, 0, 0, 0]) + (0).to_bytes(4, "little"))
        return found


def main(program):
    peer = Peer(DOMAIN)
    states = peer.writer("/joint_states", "sensor_msgs/msg/JointState", best_effort(5))
    arm = Action(peer, "/panda_arm_controller/follow_joint_trajectory", "FollowJointTrajectory")
    hand = Action(peer, "/panda_hand_controller/gripper_cmd", "GripperCommand")
    place = {"q": list(READY), "finger": 0.01, "silent": False}

    def publish():
        while not place["silent"]:
            message = make("sensor_msgs/msg/JointState", header=header(""), name=JOINTS + FINGERS,
                           position=np.array(place["q"] + [place["finger"]] * 2), velocity=np.zeros(9))
            states(message)
            time.sleep(0.02)

    threading.Thread(target=publish, daemon=True).start()
    client = subprocess.Popen([program, str(DOMAIN), "cyclonedds"], stdout=subprocess.PIPE, text=True)

    def result(code, text):
        packed = pack(make("control_msgs/msg/FollowJointTrajectoryResult", error_code=code, error_string=text),
                      "control_msgs/msg/FollowJointTrajectoryResult")
        return bytes(3) + packed

    def play(goal, trajectory, until_cancelled):
        begun = time.monotonic()
        for point in trajectory.points:
            due = point.time_from_start.sec + point.time_from_start.nanosec * 1e-9
            while time.monotonic() < begun + due * (3 if until_cancelled else 1):
                if until_cancelled and arm.cancelled(goal):
                    return False
                time.sleep(0.002)
            place["q"] = [float(value) for value in point.positions]
            feedback = make("control_msgs/msg/FollowJointTrajectoryFeedback", header=header(""), joint_names=JOINTS, actual=point)
            arm.feedback(goal + pack(feedback, "control_msgs/msg/FollowJointTrajectoryFeedback"))
        return True

    goals, hands, silent_at = 0, 0, None
    gripper_result = "control_msgs/msg/GripperCommandResult"
    limit = time.monotonic() + 120
    while client.poll() is None and time.monotonic() < limit:
        arm.serve()
        hand.serve()
        for head, content in arm.goals.requests():
            goal, wanted = content[:16], unpack(content[16:], "control_msgs/msg/FollowJointTrajectoryGoal")
            goals += 1
            assert wanted.trajectory.joint_names == JOINTS and len(wanted.trajectory.points) > 10, wanted.trajectory
            arm.accept(head, goals != 3)
            if goals == 1:
                play(goal, wanted.trajectory, False)
                arm.end(goal, SUCCEEDED, result(0, ""))
            elif goals == 2:
                arm.end(goal, ABORTED, result(-4, "joint 7 was held"))
            elif goals in (4, 5):
                # Without a cancellation, the goal succeeds, and the client's line shows this.
                arm.end(goal, SUCCEEDED if play(goal, wanted.trajectory, True) else CANCELED, result(0, ""))
        for head, content in hand.goals.requests():
            goal, wanted = content[:16], unpack(content[16:], "control_msgs/msg/GripperCommandGoal")
            hands += 1
            hand.accept(head, True)
            if hands == 3:
                # It runs in parallel with the fifth trajectory.
                hand.running, hand.running_result = goal, bytes(7) + pack(make(gripper_result, position=0.02), gripper_result)
                continue
            if hands == 4:
                until = time.monotonic() + 25
                while not hand.cancelled(goal) and time.monotonic() < until:
                    time.sleep(0.002)
                hand.end(goal, CANCELED, bytes(7) + pack(make(gripper_result, position=0.03), gripper_result))
                silent_at = time.monotonic() + 0.5
                continue
            place["finger"] = wanted.position if hands == 1 else 0.015
            time.sleep(0.2)
            answer = make(gripper_result, position=place["finger"], effort=wanted.max_effort,
                          stalled=hands == 2, reached_goal=hands == 1)
            hand.end(goal, SUCCEEDED, bytes(7) + pack(answer, gripper_result))
        if silent_at and time.monotonic() > silent_at:
            place["silent"] = True
        time.sleep(0.002)

    lines = client.stdout.read().splitlines()
    print("\n".join("      " + line for line in lines))
    told = dict(line.split(": ", 1) for line in lines if ": " in line)
    failed = 0
    for name, expected in [
        ("first", "arrived"), ("second", "path tolerance violated joint 7 was held"), ("third", "refused the trajectory"),
        ("fourth", "a person requested it"), ("open", "80 mm, holds nothing"), ("grasp", "30 mm, holds"),
        ("fifth", "a person requested it"), ("endless", "/panda_hand_controller/gripper_cmd did not end within 15 s"),
        ("silent", "no joint states on /joint_states"),
    ]:
        good = expected in told.get(name, "")
        failed += not good
        print(("ok    " if good else "FAIL  ") + f"{name}: {told.get(name)}")
    good = int(told.get("feedback", 0)) > 0 and done == ["cancel"] * 4
    print(("ok    " if good else "FAIL  ") + f"feedback {told.get('feedback')}, cancellations {len(done)}")
    return failed + (not good) > 0 or client.returncode != 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
