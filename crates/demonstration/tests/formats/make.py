#!/usr/bin/env python3
"""Writes the files of this folder with the tools whose formats they are.

    pip install labelme==6.3.1 ultralytics==8.4.190 supervision==0.31.2 numpy onnxruntime
    python make.py                 # the files that ../formats.rs reads
    python make.py --sdg PATH      # checks that the same tools read what `sdg annotation convert` writes

Everything comes from datasets/demonstrations/fuel_line: a box, a grasp line and an outline. Each tool's own writer
writes its file; nothing is edited afterwards. OpenDR's augmentation has no package: its two arrays are made here in the
layout that its augmentation_gui.py saves, and written by numpy.save as there.
"""

import argparse
import json
import math
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
DEMONSTRATION = HERE.parents[3] / "datasets" / "demonstrations" / "fuel_line"


def demonstration():
    coco = json.loads((DEMONSTRATION / "annotation.json").read_text())
    [annotation] = coco["annotations"]
    x, y, width, height = annotation["bbox"]
    outline = np.array(annotation["segmentation"][0]).reshape(-1, 2)
    start, end = np.array(annotation["keypoints"]).reshape(2, 3)[:, :2]
    return coco, [x, y, x + width, y + height], start, end, outline


def labelme_file():
    from labelme import LabelFile

    _, (x1, y1, x2, y2), start, end, outline = demonstration()

    def shape(label, kind, points):
        return dict(label=label, points=[[float(x), float(y)] for x, y in points], group_id=1, description="",
                    shape_type=kind, flags={}, mask=None)

    shapes = [
        shape("fuel_line", "rectangle", [(x2, y1), (x1, y2)]),
        shape("grasp_start", "point", [start]),
        shape("grasp_end", "point", [end]),
        shape("fuel_line", "polygon", outline),
    ]
    LabelFile().save(filename=str(HERE / "labelme.json"), shapes=shapes, image_path="image.png", image_height=480,
                     image_width=640)


def yolo_file():
    from ultralytics.data.converter import convert_coco

    coco, *_ = demonstration()
    with tempfile.TemporaryDirectory() as folder:
        labels = Path(folder) / "annotations"
        labels.mkdir()
        (labels / "person_keypoints_x.json").write_text(json.dumps(coco))
        convert_coco(str(labels), save_dir=str(Path(folder) / "out"), use_keypoints=True, cls91to80=False)
        [label] = (Path(folder) / "out").rglob("image.txt")
        shutil.copyfile(label, HERE / "yolo-pose.txt")


def coco_file():
    import supervision as sv
    from PIL import Image

    _, box, _, _, outline = demonstration()
    mask = sv.polygon_to_mask(np.round(outline).astype(int), (640, 480)).astype(bool)
    detections = sv.Detections(xyxy=np.array([box]), mask=mask[None], class_id=np.array([0]))
    name = "image.png"
    with tempfile.TemporaryDirectory() as folder:
        image = Path(folder) / name
        Image.new("RGB", (640, 480)).save(image)
        dataset = sv.DetectionDataset(classes=["fuel_line"], images=[str(image)], annotations={str(image): detections})
        dataset.as_coco(annotations_path=str(HERE / "coco-supervision.json"))


def opendr_files():
    _, box, start, end, _ = demonstration()
    line = np.stack([np.linspace(start[axis], end[axis], 12) for axis in (0, 1)])
    corners = np.array([[box[0], box[0], box[2], box[2]], [box[1], box[3], box[3], box[1]]])
    boxes, keypoints = [], []
    for turn in range(0, 360, 60):
        angle, middle = math.radians(turn), np.array([[320.0], [240.0]])
        rotation = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
        place = lambda points: 1.3 * rotation @ (points - middle) + middle + [[20.0], [-10.0]]
        turned, marked = place(corners), place(line)
        boxes.append((*np.float32(turned.min(axis=1)), *np.float32(turned.max(axis=1))))
        keypoints.append([np.float32(marked[0]), np.float32(marked[1])])
    np.save(HERE / "boxes_train.npy", boxes)
    np.save(HERE / "kps_train.npy", keypoints)


def check(sdg):
    """What `sdg annotation convert` writes, read by the tools themselves."""
    from labelme import LabelFile
    from ultralytics.data.utils import verify_image_label

    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        shutil.copyfile(DEMONSTRATION / "image.png", folder / "image.png")
        convert = lambda out: subprocess.run([sdg, "annotation", "convert", DEMONSTRATION / "annotation.json", folder / out,
                                              *(["--format", "labelme"] if out.endswith("json") else [])], check=True)
        convert("labelme.json")
        read = LabelFile(str(folder / "labelme.json"))
        assert [shape["shape_type"] for shape in read.shapes] == ["rectangle", "point", "point", "polygon"], read.shapes

        convert("image.txt")
        image, labels, shape, _, keypoints, missing, found, empty, corrupt, message = verify_image_label(
            (str(folder / "image.png"), str(folder / "image.txt"), "", True, 1, 2, 3, False))
        assert (missing, found, empty, corrupt) == (0, 1, 0, 0), message
        expected = (HERE / "yolo-pose.txt").read_text().split()
        numbers = np.concatenate([labels.ravel(), keypoints.ravel()])
        assert np.allclose(numbers, np.array(expected, dtype=float), atol=1e-5), (numbers, expected)
    print("labelme and ultralytics read what sdg writes")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sdg", type=Path)
    arguments = parser.parse_args()
    if arguments.sdg:
        check(arguments.sdg.resolve())
    else:
        labelme_file()
        yolo_file()
        coco_file()
        opendr_files()
