"""Checks rendered sets. Usage: check_sets.py SETS_DIR [--sheets DIR]

Every picture of truth.json exists and can be read, instances lie inside the picture unless optional, the outline of
demo.json is valid, and enough look-alikes of chiral parts are mirrored. A sheet shows a set's pictures with their
ground truth.
"""

import argparse
import json
import os

import cv2
import numpy as np

COLOURS = dict(polygon=(0, 200, 0), rectangle=(200, 80, 0), point=(0, 0, 255))


def draw_demo(picture, marks):
    for s in marks["shapes"]:
        p = np.array(s["points"])
        colour = COLOURS[s["shape_type"]]
        if s["shape_type"] == "polygon":
            cv2.polylines(picture, [np.round(p).astype(int)], True, colour, 1, cv2.LINE_AA)
        elif s["shape_type"] == "rectangle":
            cv2.rectangle(picture, tuple(p[0].astype(int)), tuple(p[1].astype(int)), colour, 1)
        else:
            cv2.circle(picture, tuple(p[0].astype(int)), 4, colour, 1)


def draw_truth(picture, entry):
    for i in entry["instances"]:
        a, b = (tuple(np.round(p).astype(int).tolist()) for p in i["points_px"])
        cv2.arrowedLine(picture, a, b, (0, 0, 255), 2, cv2.LINE_AA, tipLength=0.3)
    text = f"{entry['image']} {entry['light']} {entry['table']} {entry.get('what', '')}"
    cv2.putText(picture, text, (6, 20), 0, 0.6, (255, 255, 255), 4)
    cv2.putText(picture, text, (6, 20), 0, 0.6, (160, 0, 0), 2)


def check(folder):
    """Returns the number of pictures, the faults, and the pictures with their ground truth drawn."""
    with open(os.path.join(folder, "truth.json")) as f:
        truth = json.load(f)
    with open(os.path.join(folder, "set.json")) as f:
        about = json.load(f)
    with open(os.path.join(folder, "demo.json")) as f:
        marks = json.load(f)
    faults, pictures = [], []
    outline = next(np.array(s["points"]) for s in marks["shapes"] if s["shape_type"] == "polygon")
    if not 3 <= len(outline) <= 60:
        faults.append(f"outline of {len(outline)} points")
    for file in ["demo.jpg"] + [t["image"] for t in truth]:
        picture = cv2.imread(os.path.join(folder, file))
        if picture is None or picture.shape != (480, 640, 3):
            faults.append(f"{file} cannot be read")
            picture = np.zeros((480, 640, 3), np.uint8)
        elif picture.std() < 4:
            faults.append(f"{file} is blank")
        pictures.append(picture)
    draw_demo(pictures[0], marks)
    for entry, picture in zip(truth, pictures[1:], strict=True):
        draw_truth(picture, entry)
        for i in entry["instances"]:
            x, y = i["centre_px"]
            if not i["optional"] and not (0 <= x < 640 and 0 <= y < 480):
                faults.append(f"{entry['image']}: instance outside")
        if entry["present"] != bool(entry["instances"]) or entry["present"] == entry["kind"].startswith("neg"):
            faults.append(f"{entry['image']}: present is {entry['present']}")
    looks = [t["what"] for t in truth if t["kind"] == "neg_look"]
    mirrored = looks.count("mirror image")
    if about["chiral"] and mirrored < 0.4 * len(looks):
        faults.append(f"{mirrored} of {len(looks)} look-alikes mirrored")
    return len(pictures), faults, pictures


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("sets")
    args.add_argument("--sheets")
    args = args.parse_args()
    total = bad = 0
    for name in sorted(os.listdir(args.sets)):
        folder = os.path.join(args.sets, name)
        if not os.path.exists(os.path.join(folder, "truth.json")):
            print(name, "is not complete")
            continue
        count, faults, pictures = check(folder)
        total, bad = total + count, bad + len(faults)
        print(name, count, "pictures", "; ".join(faults) or "in order")
        if args.sheets:
            os.makedirs(args.sheets, exist_ok=True)
            small = [cv2.resize(p, (320, 240), interpolation=cv2.INTER_AREA) for p in pictures]
            small += [np.full_like(small[0], 255)] * (-len(small) % 5)
            rows = [np.hstack(small[k : k + 5]) for k in range(0, len(small), 5)]
            cv2.imwrite(os.path.join(args.sheets, f"{name}.png"), np.vstack(rows))
    print(f"{total} pictures, {bad} faults")


if __name__ == "__main__":
    main()
