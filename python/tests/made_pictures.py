"""Test pictures made from the shipped photos, and PNG files from arrays."""

import struct
import zlib
from pathlib import Path

import numpy as np
import numpy.typing as npt

import sdg

DEMONSTRATIONS = Path(__file__).resolve().parents[2] / "datasets" / "demonstrations"
CAMERA = DEMONSTRATIONS.parent / "workcell" / "camera.yaml"
PART = "pendulum"
PHOTO = DEMONSTRATIONS / PART / "image.png"
MARKS = DEMONSTRATIONS / PART / "annotation.json"

Picture = npt.NDArray[np.uint8]


def write_png(path: Path, picture: Picture) -> None:
    """Writes 8-bit RGB with numpy and zlib only, so that no other library affects the comparison of the programs."""
    height, width, _ = picture.shape
    rows = np.concatenate([np.zeros((height, 1), np.uint8), picture.reshape(height, 3 * width)], axis=1)

    def chunk(name: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    compressed = zlib.compress(rows.tobytes(), 1)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", compressed) + chunk(b"IEND", b""))


def pictures_of_part() -> dict[str, Picture]:
    """Ten pictures by name, of 640 x 480 pixels: with one part, two parts, a partly covered part, and other parts."""
    photo = sdg.read_picture(PHOTO)
    noise = np.random.default_rng(1).integers(-12, 13, photo.shape)
    covered = photo.copy()
    covered[:, :310] = covered[0, 0]
    twice = photo.copy()
    # The part lies in x from 259 to 388 and y from 168 to 278.
    twice[20:170, 20:180] = photo[150:300, 240:400]
    of_part = {
        "photo": photo,
        "half_turn": photo[::-1, ::-1],
        "mirrored": photo[:, ::-1],
        "shifted": np.roll(photo, (31, -47), axis=(0, 1)),
        "darker": (photo * 0.8).astype(np.uint8),
        "noisy": (photo.astype(np.int64) + noise).clip(0, 255).astype(np.uint8),
        "covered": covered,
        "twice": twice,
    }
    others = {name: sdg.read_picture(DEMONSTRATIONS / name / "image.png") for name in ("key", "pliers")}
    return {**of_part, **others}


def touching() -> Picture:
    """Two parts so close that the jaws at each would touch the other."""
    photo = sdg.read_picture(PHOTO)
    picture = photo.copy()
    table = np.median(photo, axis=(0, 1))
    rows, columns = np.nonzero(np.abs(photo - table).sum(axis=2)[150:300, 240:400] > 60)
    picture[rows + 100, columns + 240] = photo[rows + 150, columns + 240]
    return picture
