"""Runs OpenCV's calibrateHandEye on the robots that crates/calibration/tests/hand_eye.rs simulates.

    cargo test --release -p sdg-calibration --test calibration hand_eye::write_trials -- --ignored --nocapture   # prints FILE
    python tests/golden/opencv/hand_eye.py FILE > tests/golden/opencv/hand_eye.json

Needs opencv-contrib-python-headless 4.11. The pose of each board comes from solvePnP (SOLVEPNP_ITERATIVE, which minimises the reprojection error).
"""

import hashlib
import json
import sys

import cv2
import numpy as np

text = open(sys.argv[1], "rb").read()
told = json.loads(text)
fx, fy, cx, cy = told["camera"]
# Our frame has the first pixel's centre at (0.5, 0.5), OpenCV's at (0, 0).
matrix = np.array([[fx, 0, cx - 0.5], [0, fy, cy - 0.5], [0, 0, 1]])
lens = np.array(told["lens"])
METHODS = ["TSAI", "PARK", "HORAUD", "ANDREFF", "DANIILIDIS"]


def transform(values):
    x, y, z, i, j, k, w = values
    rotation = np.array([[1 - 2 * (j * j + k * k), 2 * (i * j - k * w), 2 * (i * k + j * w)],
                         [2 * (i * j + k * w), 1 - 2 * (i * i + k * k), 2 * (j * k - i * w)],
                         [2 * (i * k - j * w), 2 * (j * k + i * w), 1 - 2 * (i * i + j * j)]])
    result = np.eye(4)
    result[:3, :3], result[:3, 3] = rotation, (x, y, z)
    return result


def board_pose(corners):
    points = np.array([[i * told["square_m"], j * told["square_m"], 0] for i, j, _, _ in corners])
    pixels = np.array([[x - 0.5, y - 0.5] for _, _, x, y in corners])
    _, turn, shift = cv2.solvePnP(points, pixels, matrix, lens)
    return cv2.Rodrigues(turn)[0], shift


result = {"opencv": cv2.__version__, "sha256": hashlib.sha256(text).hexdigest()}
for name in ("hand", "base"):
    truth = transform(told[name]["truth"])
    errors = {method: [] for method in METHODS}
    for views in told[name]["trials"]:
        robot = [transform(view["base_from_flange"]) for view in views]
        if name == "base":
            # According to OpenCV's documentation, a camera beside the robot needs the inverse poses.
            robot = [np.linalg.inv(pose) for pose in robot]
        boards = [board_pose(view["corners"]) for view in views]
        for method in METHODS:
            turn, shift = cv2.calibrateHandEye([pose[:3, :3] for pose in robot], [pose[:3, 3] for pose in robot],
                                               [pose[0] for pose in boards], [pose[1] for pose in boards],
                                               method=getattr(cv2, "CALIB_HAND_EYE_" + method))
            off = 1000 * np.linalg.norm(shift.ravel() - truth[:3, 3])
            cosine = (np.trace(turn.T @ truth[:3, :3]) - 1) / 2
            errors[method].append((off, np.degrees(np.arccos(np.clip(cosine, -1, 1)))))
    result[name] = {}
    for method, values in errors.items():
        # As in the test: of two middle values, the upper one.
        values = np.sort(np.array(values), axis=0)
        middle = values[len(values) // 2]
        result[name][method] = {"median_mm": middle[0], "median_deg": middle[1], "worst_mm": values[-1][0],
                                "worst_deg": values[-1][1]}
print(json.dumps(result, indent=1))
