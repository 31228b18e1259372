"""The pictures and their ground truth, by the same formulas as `benches/src/scene.rs`."""

import numpy as np

WIDTH, HEIGHT = 640, 480


def picture(number=0):
    """`[480, 640, 3]` bytes, red first."""
    x, y = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    planes = [x ^ y, x * y // 64 + 40 * number, x + 2 * y]
    return np.stack([plane & 255 for plane in planes], axis=2).astype(np.uint8)


def boxes(columns, rows):
    """One box in each cell of a grid: `[columns * rows, 4]`, x1 y1 x2 y2."""
    width, height = WIDTH // columns, HEIGHT // rows
    found = []
    for row in range(rows):
        for column in range(columns):
            x = column * width + width // 10 + (5 * column + 3 * row) % 8
            y = row * height + height // 10 + (3 * column + 7 * row) % 10
            found.append([x, y, x + 3 * width // 4, y + 3 * height // 4])
    return np.array(found, dtype=np.float32)


def keypoints(all_boxes, count):
    """Points along each box's diagonal: `[boxes, count, 3]`, x y visibility."""
    along = (np.arange(count, dtype=np.float32) + 0.5) / count
    low, high = all_boxes[:, None, :2], all_boxes[:, None, 2:]
    points = low + (high - low) * along[None, :, None]
    return np.concatenate([points, np.full_like(points[..., :1], 2.0)], axis=2)


def masks(all_boxes):
    """Each box without its lower right quarter: `[boxes, 480, 640]` bytes."""
    found = np.zeros((len(all_boxes), HEIGHT, WIDTH), dtype=np.uint8)
    for mask, (x1, y1, x2, y2) in zip(found, all_boxes.astype(int)):
        mask[y1:y2, x1:x2] = 1
        mask[(y1 + y2) // 2 : y2, (x1 + x2) // 2 : x2] = 0
    return found
