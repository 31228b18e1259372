#!/usr/bin/env python3
"""Prints the percentage of reached lines from llvm-cov's summary, per reader and per file. Called by coverage.sh."""
import json
import os
import sys

# The files that read input from outside, by the targets that attack them.
READERS = [
    ("checkpoint", ["weights-conversion/src/pickle/", "weights-conversion/src/checkpoint.rs", "weights-conversion/src/element.rs",
                    "weights-conversion/src/safetensors_file.rs", "weights-conversion/src/source.rs", "weights-conversion/src/tensor.rs",
                    "weights-conversion/src/torch.rs", "weights-conversion/src/zip_archive.rs"]),
    ("model", ["crates/grasp/src/model_file.rs", "crates/grasp/src/safetensors_file.rs", "crates/grasp/src/base_weights_file.rs",
               "crates/grasp/src/facts.rs"]),
    ("detector_config", ["crates/detection/src/config_file.rs"]),
    ("coco", ["crates/demonstration/src/coco.rs", "crates/demonstration/src/coco_image.rs", "crates/demonstration/src/label_file.rs",
              "crates/demonstration/src/json.rs", "crates/demonstration/src/keypoint_row.rs"]),
    ("labelme", ["crates/demonstration/src/labelme.rs"]),
    ("yolo, data_yaml", ["crates/demonstration/src/yolo_pose.rs", "crates/demonstration/src/data_yaml.rs"]),
    ("opendr", ["crates/demonstration/src/npy.rs", "crates/demonstration/src/opendr.rs"]),
    ("formats together", ["crates/demonstration/src/draft.rs", "crates/demonstration/src/format.rs",
                          "crates/demonstration/src/foreign.rs"]),
    ("png, jpeg, tiff, webp_bmp_ppm", ["crates/picture/src/" + name for name in
                                       ["decode.rs", "jpeg.rs", "jpeg_gap.rs", "ppm.rs", "samples.rs", "tiff.rs", "webp.rs"]]),
    ("camera_file", ["crates/calibration/src/camera_file.rs", "crates/calibration/src/camera_sections.rs"]),
    ("robot_poses", ["crates/calibration/src/hand_eye/poses_file.rs"]),
    ("workcell", ["crates/robot/src/workcell/"]),
    ("franka", ["crates/fci/src/wire/", "crates/fci/src/message.rs"]),
    ("fci_server", ["crates/fci/src/server/" + name for name in
                    ["robot.rs", "hand.rs", "settings.rs", "motion.rs", "monitor.rs", "communication.rs", "cartesian.rs", "reference.rs",
                     "torque.rs", "report.rs"]]),
    ("ros2", ["crates/ros2/src/cdr.rs", "crates/ros2/src/encoding.rs", "crates/ros2/src/camera_info.rs", "crates/ros2/src/transforms.rs",
              "crates/ros2/src/messages/"]),
    ("http_camera", ["crates/camera/src/http/"]),
    ("live_page", ["crates/camera/src/server.rs"]),
    ("page, start_page", ["crates/annotate/src/server.rs", "crates/annotate/src/http.rs", "crates/annotate/src/guard.rs",
                          "crates/annotate/src/routes/", "crates/annotate/src/marks.rs", "crates/annotate/src/desk.rs"]),
    ("web", ["crates/web/src/detector.rs"]),
    ("bindings", ["crates/bindings/src/camera.rs", "crates/bindings/src/picture.rs", "crates/bindings/src/tracker.rs",
                  "crates/bindings/src/threads.rs"]),
    ("c_border", ["crates/capi/src/border.rs", "crates/capi/src/convert.rs", "crates/capi/src/functions.rs", "crates/capi/src/handles.rs"]),
]


def main() -> None:
    with open(sys.argv[1], encoding="utf-8") as summary:
        files = json.load(summary)["data"][0]["files"]
    root = os.getcwd() + "/"
    lines = {file["filename"].removeprefix(root): file["summary"]["lines"] for file in files}
    listed = []
    print("| reader | lines | reached |")
    print("|---|--:|--:|")
    for reader, places in READERS:
        names = sorted(name for name in lines if any(name == place or place.endswith("/") and name.startswith(place) for place in places))
        if not names:
            sys.exit(f"expected files of {reader} in the summary, found none of {places}")
        listed += names
        count, covered = (sum(lines[name][key] for name in names) for key in ("count", "covered"))
        print(f"| `{reader}` | {count} | {100 * covered / max(count, 1):.0f} % |")
    print()
    for name in listed:
        count, covered = lines[name]["count"], lines[name]["covered"]
        print(f"{100 * covered / max(count, 1):5.0f} % of {count:5}  {name}")


if __name__ == "__main__":
    main()
