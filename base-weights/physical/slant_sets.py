"""Warps a set of pictures and its ground truth to the views of a camera that has moved around the middle of each scene.

usage: slant_sets.py SET OUT TILT_DEG [--seed 1] [--lens-deg 49]

SET has demo.*, truth.json and pictures, as shared/real and shared/physical. The table is taken as a plane.
`--lens-deg` is the lens's field of view across the longer side. The azimuth of each picture follows from the seed and
the picture's name, and is the same at every tilt.
"""
import argparse
import json
import math
import pathlib
import random
import shutil

import cv2
import numpy


def homography(width, height, lens, tilt, azimuth):
    """Maps positions in the level picture to positions in the slanted one, in pixels."""
    focal = 0.5 * max(width, height) / math.tan(lens / 2)
    c, s = math.cos(azimuth), math.sin(azimuth)
    along = numpy.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    slanted = numpy.array([[math.cos(tilt), 0, 0], [0, 1, 0], [math.sin(tilt) / focal, 0, 1]])
    middle = numpy.array([[1, 0, 0.5 * width], [0, 1, 0.5 * height], [0, 0, 1]])
    return middle @ along.T @ slanted @ along @ numpy.linalg.inv(middle)


def mapped(matrix, point):
    x, y, w = matrix @ [*point, 1]
    return [x / w, y / w]


def warp_instance(matrix, instance):
    near = numpy.array([mapped(matrix, numpy.add(instance["centre_px"], step)) for step in ([0.5, 0], [-0.5, 0], [0, 0.5], [0, -0.5])])
    scale = math.sqrt(abs(numpy.linalg.det(numpy.array([near[0] - near[1], near[2] - near[3]]))))
    start, end = (mapped(matrix, point) for point in instance["points_px"])
    before = numpy.subtract(instance["points_px"][1], instance["points_px"][0])
    after = numpy.subtract(end, start)
    turned = math.degrees(math.atan2(after[1], after[0]) - math.atan2(before[1], before[0]))
    return instance | {
        "points_px": [start, end],
        "centre_px": mapped(matrix, instance["centre_px"]),
        "angle_deg": (instance["angle_deg"] + turned + 180) % 360 - 180,
        "scale": instance["scale"] * scale,
        "diag_px": instance["diag_px"] * scale,
    }


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("set", type=pathlib.Path)
    args.add_argument("out", type=pathlib.Path)
    args.add_argument("tilt_deg", type=float)
    args.add_argument("--seed", type=int, default=1)
    args.add_argument("--lens-deg", type=float, default=49.0)
    args = args.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    for file in args.set.glob("demo.*"):
        shutil.copy(file, args.out)
    truth = json.loads((args.set / "truth.json").read_text())
    for entry in truth:
        picture = cv2.imread(str(args.set / entry["image"]))
        height, width = picture.shape[:2]
        azimuth = random.Random(f"{args.seed} {entry['image']}").uniform(0, 2 * math.pi)
        matrix = homography(width, height, math.radians(args.lens_deg), math.radians(args.tilt_deg), azimuth)
        warped = cv2.warpPerspective(picture, matrix, (width, height), borderMode=cv2.BORDER_REPLICATE)
        cv2.imwrite(str(args.out / entry["image"]), warped)
        entry["instances"] = [warp_instance(matrix, instance) for instance in entry.get("instances") or []]
    (args.out / "truth.json").write_text(json.dumps(truth, indent=1))


main()
