"""Franka's pylibfranka 0.21.3 against this project's server: python libfranka_v10.py HOST.

It uses version 10 of the robot's protocol, which the server rejects as a Panda does, and version 3 of the hand's.
Prints a line for each check.
"""

import sys

import pylibfranka

HOST = sys.argv[1]
failed = 0


def check(name, is_right, found=""):
    global failed
    failed += not is_right
    print(f"{'ok  ' if is_right else 'FAIL'} pylibfranka: {name} {found}", flush=True)


def main():
    try:
        pylibfranka.Robot(HOST, pylibfranka.RealtimeConfig.kIgnore)
        check("the error names a robot of version 5", False)
    except pylibfranka.FrankaException as exception:
        text = str(exception).split(". Please")[0]
        check("the error names a robot of version 5", "server version: 5, library version: 10" in text, text)

    hand = pylibfranka.Gripper(HOST)
    check("hand's version", hand.server_version() == 3, hand.server_version())
    check("homing", hand.homing() and abs(hand.read_once().width - 0.08) < 0.001, f"{hand.read_once().width:.4f}")
    check("hand moves to 3 cm", hand.move(0.03, 0.1) and abs(hand.read_once().width - 0.03) < 0.0015,
          f"{hand.read_once().width:.4f}")
    check("a grasp without a part is unsuccessful", not hand.grasp(0.03, 0.05, 20.0, 0.005, 0.005))
    check("  no part is held", not hand.read_once().is_grasped)
    try:
        hand.move(0.5, 0.1)
        check("a width of 0.5 m is refused", False)
    except pylibfranka.CommandException as exception:
        check("a width of 0.5 m is refused", True, exception)
    check("hand stops", hand.stop())


main()
sys.exit(failed != 0)
