"""Crops the objects of the rendered pictures in the frame of the part's photo. Usage: pack_train.py RENDERED OUT.npz

RENDERED has the folders of make_train.py. The frame is that of the network's input (128 pixels, the part 128 / 1.2
long) with a margin of 16 pixels on each side, for random shifts. A crop shows the picture at a pose of the part on an
object: the pose known from the rendering, and the poses that the program found (search_train.py). The file's arrays,
one row per crop:

    images, images_at   concatenated WebP files, and the start of each; ids, ids_at: the same for PNG files
                        (of a pixel: 0 the table, 1 the object itself, 2 another object, 3 outside the picture)
    parts               number of the part, a row of `masks` (bits of the frame in the part's outline) and `names`
    kinds               0 the demonstration, 1 the part, 2 a look-alike, 3 elsewhere or rotated
    visible, what       visible fraction of the object; the difference of a look-alike (after "found " if by the program)
    pictures            number of the picture
"""

import argparse
import glob
import json
import os

import cv2
import numpy as np

SIDE, PART_SIDE = 160, 128 / 1.2
DEMO, RIGHT, RIVAL, ELSEWHERE = range(4)  # kinds
TABLE, SELF, OTHER, OUTSIDE = range(4)  # ids
WEBP_QUALITY = 88
# A found pose belongs to an object that is NEAR (distance as a fraction of the diagonal), and is elsewhere if no object
# is within FAR.
NEAR, NEAR_TURN_DEG = 0.05, 8
FAR, FAR_TURN_DEG = 0.15, 17


def complex_points(points):
    return np.array(points) @ [1, 1j]


def similarity(a, b):
    """The similarity, as a 2 x 3 matrix, that maps the two points `a` to `b`."""
    a, b = complex_points(a), complex_points(b)
    m = (b[1] - b[0]) / (a[1] - a[0])
    t = b[0] - m * a[0]
    return np.array([[m.real, -m.imag, t.real], [m.imag, m.real, t.imag]])


class Frame:
    """The square of a photo around the part's outline: its `centre` in the photo, and `step`, photo pixels per pixel."""

    def __init__(self, outline):
        lo, hi = outline.min(0), outline.max(0)
        self.centre = (lo + hi) / 2
        self.step = (hi - lo).max() / PART_SIDE
        self.diagonal = np.hypot(*(hi - lo))
        self.inside = np.zeros((SIDE, SIDE), np.uint8)
        corners = (outline - self.centre) / self.step + SIDE / 2 - 0.5
        cv2.fillPoly(self.inside, [np.round(corners * 16).astype(int)], 1, shift=4)

    def matrix(self, image_from_photo, step):
        """Maps pixels of the frame, each `step` pixels of the photo, to pixels of the image."""
        corner = self.centre - self.step * SIDE / 2
        m = image_from_photo @ np.array([[step, 0, corner[0]], [0, step, corner[1]], [0, 0, 1]])
        m[:, 2] += m[:, :2] @ [0.5, 0.5] - 0.5  # pixel centres are at .5, in OpenCV at integers
        return m

    def cut(self, image, image_from_photo):
        """The frame's pixels of an image, sampled at twice the resolution."""
        size = (2 * SIDE, 2 * SIDE)
        m = self.matrix(image_from_photo, self.step / 2)
        large = cv2.warpAffine(image, m, size, flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)
        return cv2.resize(large, (SIDE, SIDE), interpolation=cv2.INTER_AREA)

    def cut_ids(self, ids, image_from_photo, own_id):
        """The id at each pixel of the frame: TABLE, SELF, OTHER, OUTSIDE."""
        k = cv2.warpAffine(
            ids,
            self.matrix(image_from_photo, self.step),
            (SIDE, SIDE),
            flags=cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP,
            borderMode=cv2.BORDER_CONSTANT,
            borderValue=255,
        )
        return np.select([k == 255, k == own_id, k == 0], [OUTSIDE, SELF, TABLE], OTHER).astype(np.uint8)


def found_things(folder, picture, diagonal):
    """The program's detections in a picture as (ends of the grasp line, kind, nearest object)."""
    path = os.path.join(folder, "found.jsonl")
    if not os.path.exists(path):
        return
    with open(path) as file:
        records = [json.loads(line) for line in file]
    for record in records:
        if os.path.basename(record["image"]) != picture["image"]:
            continue
        for detection in record["detections"]:
            g = detection["grasp"]
            half = g["width_px"] / 2 * np.exp(1j * np.radians(g["angle_deg"]))
            middle = g["x"] + 1j * g["y"]
            ends = [[p.real, p.imag] for p in (middle - half, middle + half)]
            b = complex_points(ends)
            errors = []
            for thing in picture["things"]:
                a = complex_points(thing["points_px"])
                turn_deg = abs(np.degrees(np.angle((b[1] - b[0]) / (a[1] - a[0]))))
                errors.append((abs(b.mean() - a.mean()) / diagonal, turn_deg))
            k = int(np.argmin([e[0] for e in errors]))
            thing = picture["things"][k]
            if errors[k][0] < NEAR and errors[k][1] < NEAR_TURN_DEG:
                yield ends, RIVAL if thing["what"] else RIGHT, thing
            elif not any(e[0] < FAR and e[1] < FAR_TURN_DEG for e in errors):
                yield ends, ELSEWHERE, thing


class Pack:
    """The crops, encoded."""

    def __init__(self):
        self.images, self.ids = [], []
        self.parts, self.kinds, self.visible, self.what, self.pictures = [], [], [], [], []
        self.masks, self.names = [], []
        self.num_pictures = 0

    def add(self, image, ids, kind, visible, what):
        """Adds a crop of the last part in the last picture."""
        self.images.append(cv2.imencode(".webp", image, [cv2.IMWRITE_WEBP_QUALITY, WEBP_QUALITY])[1])
        self.ids.append(cv2.imencode(".png", ids)[1])
        self.parts.append(len(self.names) - 1)
        self.kinds.append(kind)
        self.visible.append(visible)
        self.what.append(what)
        self.pictures.append(self.num_pictures - 1)

    def add_part(self, folder):
        with open(os.path.join(folder, "demo.json")) as file:
            shapes = json.load(file)["shapes"]
        with open(os.path.join(folder, "pairs.json")) as file:
            pairs = json.load(file)
        frame = Frame(np.array(shapes[3]["points"]))
        marks = [shapes[1]["points"][0], shapes[2]["points"][0]]
        self.names.append(os.path.basename(folder))
        self.masks.append(np.packbits(frame.inside))
        self.num_pictures += 1
        demo = cv2.imread(os.path.join(folder, "demo.jpg"))
        identity = np.eye(3)[:2]
        outside = frame.cut_ids(np.zeros(demo.shape[:2], np.uint8), identity, 1) == OUTSIDE
        ids = np.where(outside, OUTSIDE, frame.inside)
        self.add(frame.cut(demo, identity), ids, DEMO, 1.0, "")
        for picture in pairs:
            self.num_pictures += 1
            self.add_picture(folder, picture, frame, marks)

    def add_picture(self, folder, picture, frame, marks):
        image = cv2.imread(os.path.join(folder, picture["image"]))
        seen = cv2.imread(os.path.join(folder, picture["ids"]), 0)

        def add_at(ends, kind, thing, what):
            image_from_photo = similarity(marks, ends)
            ids = frame.cut_ids(seen, image_from_photo, thing["id"])
            self.add(frame.cut(image, image_from_photo), ids, kind, thing["visible"], what)

        for thing in picture["things"]:
            add_at(thing["points_px"], RIVAL if thing["what"] else RIGHT, thing, thing["what"] or "")
        for ends, kind, thing in found_things(folder, picture, frame.diagonal):
            what = {RIGHT: "found", RIVAL: f"found {thing['what']}", ELSEWHERE: "elsewhere"}[kind]
            add_at(ends, kind, thing, what)

    def save(self, path):
        def joined(files):
            starts = np.cumsum([0] + [len(f) for f in files])
            return np.concatenate([f.ravel() for f in files]), starts

        images, images_at = joined(self.images)
        ids, ids_at = joined(self.ids)
        np.savez(
            path,
            images=images,
            images_at=images_at,
            ids=ids,
            ids_at=ids_at,
            parts=self.parts,
            kinds=self.kinds,
            visible=self.visible,
            what=self.what,
            masks=self.masks,
            names=self.names,
            pictures=self.pictures,
        )


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("rendered")
    args.add_argument("out")
    args = args.parse_args()
    pack = Pack()
    for folder in sorted(glob.glob(os.path.join(args.rendered, "r_*"))):
        if os.path.exists(os.path.join(folder, "pairs.json")):
            pack.add_part(folder)
    pack.save(args.out)
    print(f"{len(pack.names)} parts, {len(pack.images)} crops, {os.path.getsize(args.out) / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
