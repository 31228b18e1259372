"""Writes tests/golden/pendulum.bin: the features of OpenCV's SIFT on a crop of the pendulum's demonstration.

    VENV/bin/python crates/sift/compare/write_golden.py

One record of 144 bytes per keypoint, little-endian: x, y (first pixel's centre at 0.5), sigma, angle in degrees (32-bit
floats), then the descriptor in OpenCV's order, 128 bytes.
"""

import pathlib

import cv2
import numpy as np

CRATE = pathlib.Path(__file__).resolve().parents[1]
LEFT, TOP, WIDTH, HEIGHT = 240, 150, 170, 150  # as in tests/opencv_golden.rs

bgr = cv2.imread(str(CRATE / "../../datasets/demonstrations/pendulum/image.png")).astype(np.uint32)
# The luma of `Plane::from_rgb`, to the bit; OpenCV rounds some pixels differently.
gray = ((114 * bgr[..., 0] + 587 * bgr[..., 1] + 299 * bgr[..., 2] + 500) // 1000).astype(np.uint8)
crop = np.ascontiguousarray(gray[TOP : TOP + HEIGHT, LEFT : LEFT + WIDTH])
keypoints, descriptors = cv2.SIFT_create().detectAndCompute(crop, None)
with open(CRATE / "tests/golden/pendulum.bin", "wb") as file:
    for keypoint, descriptor in zip(keypoints, descriptors):
        # 0.25, not 0.5: by default OpenCV's positions are a quarter of a pixel too large.
        place = [keypoint.pt[0] + 0.25, keypoint.pt[1] + 0.25, keypoint.size / 2, keypoint.angle]
        file.write(np.array(place, "<f4").tobytes() + descriptor.astype(np.uint8).tobytes())
print(f"{len(keypoints)} keypoints, OpenCV {cv2.__version__}")
