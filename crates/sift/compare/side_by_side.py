"""Compares our SIFT with OpenCV's on the same pictures: repeatability, matching score, time on two cores.

    python -m venv VENV && VENV/bin/pip install -r crates/sift/compare/requirements.txt
    cargo build --release -p sdg-sift --examples
    VENV/bin/python crates/sift/compare/side_by_side.py [PICTURE ...] [--repeats 7] [--folder FOLDER]

Without pictures, the demonstrations of this repository are used. The script rotates, scales, relights and blurs each, so
the ground truth is known; both programs read the same PNG files, and this script matches and judges both sets of features.

Terms. Keypoints count if they are at least MARGIN pixels inside both pictures. `repeatability`: number of keypoints of
one picture that have a keypoint of the other at the same position and size, divided by the smaller number of keypoints;
a position counts once, whatever its number of directions. `matching score`: number of correct matches by Lowe's ratio
test, divided by the smaller number of keypoints. `precision`: number of correct matches, divided by all matches.
"""

import argparse
import json
import math
import os
import pathlib
import subprocess
import tempfile
import time

import cv2
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[3]
RATIO = 0.8
MARGIN = 8.0  # pixels
SAME_PLACE = 2.0  # pixels of the coarser picture
SAME_SIZE = 1.4  # factor
RIGHT_MATCH = 3.0  # pixels


def similarity(shape, degrees, scale):
    """The 2 x 3 matrix that rotates and scales about the centre, in coordinates where pixel centres are at + 0.5, and the
    size of the resulting picture."""
    height, width = shape
    out_width, out_height = round(width * scale), round(height * scale)
    angle = math.radians(degrees)
    a, b = scale * math.cos(angle), scale * math.sin(angle)
    linear = np.array([[a, -b], [b, a]])
    shift = np.array([out_width, out_height]) / 2 - linear @ (np.array([width, height]) / 2)
    return np.hstack([linear, shift[:, None]]), (out_width, out_height)


def warp(gray, matrix, size):
    """Resamples without aliasing; beyond the border the picture is mirrored, to avoid false edges."""
    scale = math.hypot(matrix[0, 0], matrix[1, 0])
    source = gray.astype(np.float32)
    if scale < 1:
        # After shrinking, the picture has the camera's blur of 0.5 pixels again.
        source = cv2.GaussianBlur(source, (0, 0), 0.5 * math.sqrt(1 / scale**2 - 1))
    centred = matrix.copy()
    centred[:, 2] += matrix[:, :2] @ [0.5, 0.5] - 0.5  # OpenCV has pixel centres at integers
    warped = cv2.warpAffine(source, centred, size, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT_101)
    return np.clip(np.rint(warped), 0, 255).astype(np.uint8)


def views(gray):
    """(group, name, picture, 2 x 3 matrix from the original) of every view."""
    identity = np.array([[1.0, 0, 0], [0, 1, 0]])
    for degrees in (10, 30, 45, 75, 90, 135, 180):
        matrix, size = similarity(gray.shape, degrees, 1.0)
        yield "rotation", f"turn{degrees}", warp(gray, matrix, size), matrix
    for scale in (0.5, 0.63, 0.8, 1.25, 1.6, 2.0):
        matrix, size = similarity(gray.shape, 0, scale)
        yield "scale", f"scale{scale}", warp(gray, matrix, size), matrix
    for degrees, scale in ((25, 0.7), (-70, 1.4), (160, 0.85)):
        matrix, size = similarity(gray.shape, degrees, scale)
        yield "both", f"turn{degrees}scale{scale}", warp(gray, matrix, size), matrix
    unit = gray / 255.0
    rows, columns = np.mgrid[0 : gray.shape[0], 0 : gray.shape[1]] / max(gray.shape)
    lights = {
        "dark": 0.45 * unit,
        "bright": np.minimum(1.35 * unit + 0.05, 1),
        "gamma0.6": unit**0.6,
        "gamma1.8": unit**1.8,
        "slope": unit * (0.4 + 0.8 * columns),
        "spot": unit * (0.45 + 0.7 * np.exp(-((columns - 0.6) ** 2 + (rows - 0.3) ** 2) / 0.08)),
    }
    for name, lit in lights.items():
        yield "light", name, np.clip(np.rint(255 * lit), 0, 255).astype(np.uint8), identity
    noise = np.random.default_rng(7).normal(0, 5, gray.shape)
    yield "noise", "noise5", np.clip(np.rint(gray + noise), 0, 255).astype(np.uint8), identity
    soft = cv2.GaussianBlur(gray.astype(np.float32), (0, 0), 1.5)
    yield "noise", "blur1.5", np.clip(np.rint(soft), 0, 255).astype(np.uint8), identity


class Found:
    """Positions (n x 2), scales (n) and descriptors (n x 128)."""

    def __init__(self, places, scales, descriptors):
        self.places, self.scales, self.descriptors = places, scales, descriptors

    def at(self, which):
        return Found(self.places[which], self.scales[which], self.descriptors[which])

    def once_each_place(self):
        keys = np.round(np.column_stack([self.places, self.scales]) * 100).astype(np.int64)
        return self.at(np.sort(np.unique(keys, axis=0, return_index=True)[1]))


def read_ours(path):
    rows = np.fromfile(path, "<f4").reshape(-1, 133)
    return Found(rows[:, :2].astype(float), rows[:, 2].astype(float), rows[:, 5:])


def detect_opencv(sift, gray, center):
    """`center`: position of the first pixel's centre in OpenCV's results, in our frame, where it is at 0.5."""
    keypoints, descriptors = sift.detectAndCompute(gray, None)
    places = np.array([k.pt for k in keypoints], float).reshape(-1, 2) + center
    scales = np.array([k.size / 2 for k in keypoints], float)
    return Found(places, scales, np.zeros((0, 128), np.float32) if descriptors is None else descriptors)


def inside(places, size):
    return np.all((places >= MARGIN) & (places <= np.array(size) - MARGIN), axis=1)


def judge(first, second, matrix, first_size, second_size):
    """Numbers of keypoints (the smaller one), repeated keypoints, correct matches, and matches."""
    scale = math.hypot(matrix[0, 0], matrix[1, 0])
    back = np.linalg.inv(np.vstack([matrix, [0, 0, 1]]))[:2]
    move = lambda m, p: p @ m[:, :2].T + m[:, 2]
    common_first = first.at(inside(first.places, first_size) & inside(move(matrix, first.places), second_size))
    common_second = second.at(inside(second.places, second_size) & inside(move(back, second.places), first_size))

    a, b = common_first.once_each_place(), common_second.once_each_place()
    repeated = 0
    if len(a.places) and len(b.places):
        distance = np.linalg.norm(move(matrix, a.places)[:, None] - b.places[None], axis=2)
        size = np.abs(np.log(a.scales * scale)[:, None] - np.log(b.scales)[None])
        distance[(distance > SAME_PLACE * max(1.0, scale)) | (size > math.log(SAME_SIZE))] = np.inf
        # Only mutually nearest keypoints, so that no keypoint counts twice.
        rows = np.arange(len(a.places))
        nearest = distance.argmin(1)
        repeated = int(np.sum((distance.argmin(0)[nearest] == rows) & np.isfinite(distance[rows, nearest])))
    fewest_places = min(len(a.places), len(b.places))

    right = matches = 0
    if len(common_first.places) and len(second.places) > 1:
        x, y = common_first.descriptors.astype(np.float64), second.descriptors.astype(np.float64)
        squared = np.maximum((x**2).sum(1)[:, None] + (y**2).sum(1)[None] - 2 * x @ y.T, 0)
        order = np.argpartition(squared, 1, axis=1)[:, :2]
        two = np.take_along_axis(squared, order, 1)
        nearest = order[np.arange(len(x)), two.argmin(1)]
        passed = two.min(1) < RATIO**2 * two.max(1)
        error = np.linalg.norm(move(matrix, common_first.places) - second.places[nearest], axis=1)
        matches = int(passed.sum())
        right = int((passed & (error <= RIGHT_MATCH * max(1.0, scale))).sum())
    fewest = min(len(common_first.places), len(common_second.places))
    return fewest, fewest_places, repeated, right, matches


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("pictures", nargs="*", type=pathlib.Path)
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--folder", type=pathlib.Path, help="folder that keeps the views")
    parser.add_argument("--program", default=os.environ.get("CARGO_TARGET_DIR", str(ROOT / "target")) + "/release/examples/describe")
    arguments = parser.parse_args()
    pictures = arguments.pictures or sorted(ROOT.glob("datasets/demonstrations/*/image.png"))
    folder = arguments.folder or pathlib.Path(tempfile.mkdtemp())
    folder.mkdir(parents=True, exist_ok=True)
    cv2.setNumThreads(2)

    plan = []
    for picture in pictures:
        gray = cv2.cvtColor(cv2.imread(str(picture)), cv2.COLOR_BGR2GRAY)
        base = picture.stem if picture.stem != "image" else picture.parent.name
        cv2.imwrite(str(folder / f"{base}.png"), gray)
        for group, name, view, matrix in views(gray):
            cv2.imwrite(str(folder / f"{base}_{name}.png"), view)
            plan.append((base, group, f"{base}_{name}", matrix))
    names = sorted({base for base, *_ in plan} | {name for _, _, name, _ in plan})
    images = {name: cv2.imread(str(folder / f"{name}.png"), cv2.IMREAD_GRAYSCALE) for name in names}

    results, seconds = {}, {}
    environment = dict(os.environ, RAYON_NUM_THREADS="2")
    for label, flags in (("ours", []), ("ours, clipped", ["--clipped"])):
        command = [arguments.program, str(folder), "--repeats", str(arguments.repeats), *flags]
        seconds[label] = json.loads(subprocess.run(command, env=environment, check=True, capture_output=True).stdout)
        results[label] = {name: read_ours(folder / f"{name}.sift") for name in names}
    # By default, OpenCV doubles the picture about its pixels' corners but halves the positions as if about their centres,
    # so its positions are 0.25 too large.
    for label, precise, center in (("OpenCV", False, 0.25), ("OpenCV, precise upscale", True, 0.5)):
        sift = cv2.SIFT_create(enable_precise_upscale=precise)
        results[label], seconds[label] = {}, {}
        for name in names:
            times = []
            for _ in range(arguments.repeats):
                start = time.perf_counter()
                sift.detectAndCompute(images[name], None)
                times.append(time.perf_counter() - start)
            seconds[label][name] = sorted(times)[0], sorted(times)[len(times) // 2]
            results[label][name] = detect_opencv(sift, images[name], center)

    print(f"OpenCV {cv2.__version__}, {len(pictures)} pictures, {len(plan)} views, ratio {RATIO}\n")
    print("| pictures | views | program | keypoints | repeatability | matching score | precision | right matches |")
    print("|---|---|---|---|---|---|---|---|")
    bases = sorted({base for base, *_ in plan})
    for chosen in [[base] for base in bases] + [bases]:
        title = chosen[0] if len(chosen) == 1 else "all"
        groups = ["all"] if len(chosen) == 1 else ["rotation", "scale", "both", "light", "noise", "all"]
        for group in groups:
            for label in results:
                found, rows = results[label], []
                for base, of, name, matrix in plan:
                    if base in chosen and group in (of, "all"):
                        sizes = images[base].shape[::-1], images[name].shape[::-1]
                        rows.append(judge(found[base], found[name], matrix, *sizes))
                keypoints, places, repeated, right, matches = np.array(rows, float).T
                mean = lambda part, of: f"{100 * np.mean(part / np.maximum(of, 1)):.1f} %"
                print(
                    f"| {title} | {group} | {label} | {keypoints.mean():.0f} | {mean(repeated, places)} "
                    f"| {mean(right, keypoints)} | {mean(right, matches)} | {right.sum():.0f} |"
                )
    print("\n| milliseconds, two threads | best, sum over pictures | median, sum | features |\n|---|---|---|---|")
    for label in results:
        best, median = np.sum([seconds[label][name] for name in names], axis=0)
        features = sum(len(results[label][name].places) for name in names)
        print(f"| {label} | {1e3 * best:.0f} | {1e3 * median:.0f} | {features} |")


if __name__ == "__main__":
    main()
