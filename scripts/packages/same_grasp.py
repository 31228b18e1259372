"""Compares the lines of `sdg detect --json` from two machines for one picture. Usage: same_grasp.py NAME <lines.

Prints whether all digits are the same, and the difference of the best grasps. A difference of more than a hundredth of a pixel or degree is a failure.
"""

import json
import math
import sys

MAX_APART = 0.01

lines = [json.loads(line) for line in sys.stdin]
name = sys.argv[1]
if len(lines) != 2:
    sys.exit(f"{name}: expected a line of each machine, found {len(lines)}")
for line in lines:
    del line["seconds"], line["image"]
first, second = (line["detections"] for line in lines)
if lines[0] == lines[1]:
    print(f"{name}: the same digits, {len(first)} detection(s)")
    sys.exit(0)
if len(first) != len(second) or not first:
    sys.exit(f"{name}: {len(first)} and {len(second)} detections")
a, b = first[0]["grasp"], second[0]["grasp"]
apart = math.hypot(a["x"] - b["x"], a["y"] - b["y"])
turned = abs((a["angle_deg"] - b["angle_deg"] + 180) % 360 - 180)
scores = abs(first[0]["score"] - second[0]["score"])
print(f"{name}: {apart:.6f} px, {turned:.6f} degrees and {scores:.6f} of the score apart")
if apart > MAX_APART or turned > MAX_APART:
    sys.exit(f"{name}: further apart than {MAX_APART}")
