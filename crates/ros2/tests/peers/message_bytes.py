"""Messages with random values: compares the bytes of rosbags with ours, for the types that `main` lists.

python message_bytes.py PROGRAM: the built example cdr_round_trip.
"""

import dataclasses
import pathlib
import random
import subprocess
import sys

import numpy as np
from rosbags.typesys import Stores, get_typestore, get_types_from_msg
from rosbags.typesys.base import Nodetype

HERE = pathlib.Path(__file__).parent
INTERFACES = HERE.parent.parent / "sdg_interfaces" / "srv"
ROUNDS = 200

# As the packages define them (vision_msgs 4, control_msgs 4).
DEFINITIONS = {
    "vision_msgs/msg/Point2D": "float64 x\nfloat64 y\n",
    "vision_msgs/msg/Pose2D": "vision_msgs/Point2D position\nfloat64 theta\n",
    "vision_msgs/msg/BoundingBox2D": "vision_msgs/Pose2D center\nfloat64 size_x\nfloat64 size_y\n",
    "vision_msgs/msg/ObjectHypothesis": "string class_id\nfloat64 score\n",
    "vision_msgs/msg/ObjectHypothesisWithPose":
        "vision_msgs/ObjectHypothesis hypothesis\ngeometry_msgs/PoseWithCovariance pose\n",
    "vision_msgs/msg/Detection2D":
        "std_msgs/Header header\nvision_msgs/ObjectHypothesisWithPose[] results\nvision_msgs/BoundingBox2D bbox\nstring id\n",
    "vision_msgs/msg/Detection2DArray": "std_msgs/Header header\nvision_msgs/Detection2D[] detections\n",
    "control_msgs/msg/JointTolerance": "string name\nfloat64 position\nfloat64 velocity\nfloat64 acceleration\n",
    "control_msgs/msg/JointComponentTolerance":
        "string joint_name\nuint16 component\nfloat64 position\nfloat64 velocity\nfloat64 acceleration\n",
    "control_msgs/msg/FollowJointTrajectoryGoal":
        "trajectory_msgs/JointTrajectory trajectory\ntrajectory_msgs/MultiDOFJointTrajectory multi_dof_trajectory\n"
        "control_msgs/JointTolerance[] path_tolerance\ncontrol_msgs/JointComponentTolerance[] component_path_tolerance\n"
        "control_msgs/JointTolerance[] goal_tolerance\ncontrol_msgs/JointComponentTolerance[] component_goal_tolerance\n"
        "builtin_interfaces/Duration goal_time_tolerance\n",
    "control_msgs/msg/FollowJointTrajectoryResult": "int32 error_code\nstring error_string\n",
    "control_msgs/msg/FollowJointTrajectoryFeedback":
        "std_msgs/Header header\nstring[] joint_names\ntrajectory_msgs/JointTrajectoryPoint desired\n"
        "trajectory_msgs/JointTrajectoryPoint actual\ntrajectory_msgs/JointTrajectoryPoint error\n",
    "control_msgs/msg/GripperCommandGoal": "float64 position\nfloat64 max_effort\n",
    "control_msgs/msg/GripperCommandResult": "float64 position\nfloat64 effort\nbool stalled\nbool reached_goal\n",
    "std_srvs/msg/TriggerResponse": "bool success\nstring message\n",
}


def definitions():
    """The types above, and the requests and responses of this project's services, from their .srv files."""
    all_of_them = dict(DEFINITIONS)
    for name in ("Detect", "Teach", "Grasp"):
        request, response = (INTERFACES / f"{name}.srv").read_text().split("---\n")
        all_of_them[f"sdg_interfaces/msg/{name}Request"] = request
        all_of_them[f"sdg_interfaces/msg/{name}Response"] = response
    return all_of_them


def typestore():
    store = get_typestore(Stores.ROS2_JAZZY)
    types = {}
    for name, text in definitions().items():
        if name not in store.types:
            types.update(get_types_from_msg(text, name))
    store.register(types)
    return store


def value_of(store, description, dice):
    kind, details = description
    if kind == Nodetype.NAME:
        return message_of(store, details, dice)
    if kind == Nodetype.BASE:
        return base_of(details[0], dice)
    element, length = details
    if kind == Nodetype.SEQUENCE:
        length = dice.randrange(4)
    if element[0] == Nodetype.BASE and element[1][0] != "string":
        kinds = {"octet": "uint8", "byte": "uint8", "char": "uint8"}
        return np.array([base_of(element[1][0], dice) for _ in range(length)], dtype=kinds.get(element[1][0], element[1][0]))
    return [value_of(store, element, dice) for _ in range(length)]


def base_of(name, dice):
    if name == "string":
        return "".join(dice.choice("abcxyz/_é ") for _ in range(dice.randrange(9)))
    if name == "bool":
        return dice.random() < 0.5
    if name.startswith("float"):
        return float(np.float32(dice.uniform(-5, 5)))
    if name in ("octet", "byte", "char"):
        # rosbags treats some of these types as signed.
        return dice.randrange(128)
    bits = int(name.lstrip("uint"))
    return dice.randrange(2**bits) if name[0] == "u" else dice.randrange(-(2 ** (bits - 1)), 2 ** (bits - 1))


def message_of(store, name, dice):
    fields = store.get_msgdef(name).fields
    values = [value_of(store, description, dice) for _, description in fields]
    return store.types[name](*values)


def main(program):
    store, dice = typestore(), random.Random(22)
    names = [
        "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage", "sensor_msgs/msg/CameraInfo",
        "sensor_msgs/msg/JointState", "geometry_msgs/msg/PoseStamped", "tf2_msgs/msg/TFMessage",
        "vision_msgs/msg/Detection2DArray", "diagnostic_msgs/msg/DiagnosticArray",
        "control_msgs/msg/FollowJointTrajectoryGoal", "control_msgs/msg/FollowJointTrajectoryResult",
        "control_msgs/msg/FollowJointTrajectoryFeedback", "control_msgs/msg/GripperCommandGoal",
        "control_msgs/msg/GripperCommandResult", "sdg_interfaces/msg/DetectRequest", "sdg_interfaces/msg/DetectResponse",
        "sdg_interfaces/msg/TeachRequest", "sdg_interfaces/msg/TeachResponse", "sdg_interfaces/msg/GraspRequest",
        "sdg_interfaces/msg/GraspResponse", "std_srvs/msg/TriggerResponse",
    ]
    sent = []
    for name in names:
        for _ in range(ROUNDS):
            # The first four bytes identify the encoding.
            sent.append((name, bytes(store.serialize_cdr(message_of(store, name, dice), name))[4:]))
    lines = "\n".join(f"{name} {data.hex()}" for name, data in sent)
    answers = subprocess.run([program], input=lines, capture_output=True, text=True, check=True).stdout.splitlines()
    assert len(answers) == len(sent), (len(answers), len(sent))
    failed = 0
    for (name, data), answer in zip(sent, answers):
        # rosbags pads the end of a message, which readers ignore.
        ours = bytes.fromhex(answer) if not answer.startswith("error") else None
        if ours is None or data[: len(ours)] != ours or any(data[len(ours):]) or len(data) - len(ours) > 7:
            failed += 1
            if failed < 10:
                print(f"FAIL {name}: {data.hex()} became {answer}")
    print(f"{len(sent) - failed} of {len(sent)} messages of {len(names)} types are the same bytes as rosbags'")
    return failed > 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
