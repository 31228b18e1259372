"""Runs OpenCV's calibrateCamera on the pictures that crates/calibration/tests/intrinsics.rs renders.

    cargo test --release -p sdg-calibration --test calibration intrinsics::write_pictures -- --ignored --nocapture   # prints FOLDER
    python tests/golden/opencv/calibrate.py FOLDER > tests/golden/opencv/calibration.json

Needs opencv-contrib-python-headless 4.11. The lens has k1, k2, p1, p2, as ours without --k3. The corners are found by
findChessboardCornersSB, or by findChessboardCorners with cornerSubPix (five window sizes); the corners with the lowest
reprojection error are used.
"""

import json
import pathlib
import sys

import cv2
import numpy as np

folder = pathlib.Path(sys.argv[1])
told = json.loads((folder / "pictures.json").read_text())
columns, rows, square = (told["board"][key] for key in ("columns", "rows", "square_m"))
shape = (columns - 1, rows - 1)
grid = np.array([[x * square, y * square, 0] for y in range(shape[1]) for x in range(shape[0])], np.float32)


def sector_based(picture):
    return cv2.findChessboardCornersSB(picture, shape, flags=cv2.CALIB_CB_ACCURACY | cv2.CALIB_CB_EXHAUSTIVE)


def sub_pixel(half_window):
    def way(picture):
        found, corners = cv2.findChessboardCorners(picture, shape)
        if found:
            criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 100, 1e-4)
            corners = cv2.cornerSubPix(picture, corners, (half_window, half_window), (-1, -1), criteria)
        return found, corners

    way.__name__ = f"sub_pixel_{half_window}"
    return way


def calibrate(points, corners, size):
    flags = cv2.CALIB_FIX_K3
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 100, 1e-12)
    rms, matrix, lens, _, _ = cv2.calibrateCamera(points, corners, size, None, None, flags=flags, criteria=criteria)
    return rms, matrix, lens.ravel()


result = {"opencv": cv2.__version__, "cameras": {}}
for name, camera in told["cameras"].items():
    pictures = [cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in sorted(folder.glob(f"{name}_*.png"))]
    size = pictures[0].shape[::-1]
    best = None
    for way in (sector_based, *map(sub_pixel, (3, 4, 5, 7, 9))):
        found = [way(picture) for picture in pictures]
        corners = [np.float32(corners) for is_found, corners in found if is_found]
        print(name, way.__name__, len(corners), "of", len(pictures), file=sys.stderr)
        if len(corners) < 10:
            continue
        rms, matrix, lens = calibrate([grid] * len(corners), corners, size)
        print("  rms", rms, "fx", matrix[0, 0], file=sys.stderr)
        if best is None or rms < best["rms_px"]:
            best = {"corners": way.__name__, "pictures": len(corners), "rms_px": rms, "fx": matrix[0, 0], "fy": matrix[1, 1],
                    "cx": matrix[0, 2], "cy": matrix[1, 2], "lens": list(lens)}
    # Our corners have the first pixel's centre at (0.5, 0.5), OpenCV's at (0, 0).
    points = [np.array([[i * square, j * square, 0] for i, j, _, _ in view], np.float32) for view in camera["corners"]]
    ours = [np.array([[[x - 0.5, y - 0.5]] for _, _, x, y in view], np.float32) for view in camera["corners"]]
    rms, matrix, _ = calibrate(points, ours, size)
    result["cameras"][name] = {"sha256": camera["sha256"], **best, "rms_px_on_our_corners": rms,
                               "fx_on_our_corners": matrix[0, 0]}
print(json.dumps(result, indent=1))
