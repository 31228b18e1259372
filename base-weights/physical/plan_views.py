"""Plan views of bodies, and the pose at which a part covers a look-alike best.

A plan view is a pair (height, value) of CELL x CELL pictures from straight above, with the body's origin at the centre
and rows towards -y: height above the table in mm (0: the table) and lightness of the material or print, 0 to 1.
"""

import cv2
import numpy as np
import trimesh
from trimesh.ray.ray_pyembree import RayMeshIntersector

import materials

CELL = 160  # pixels per side of a plan view
MIN_STEP_MM = 0.8  # a smaller difference in height is invisible
MIN_VALUE_STEP = 0.15  # a smaller difference in lightness is invisible
EDGE_WEIGHT = 0.6  # weight of equal edges relative to equal area


def print_values(group, faces, points):
    """Lightness of a printed group at points (x, y) on faces, given by their indices in the group."""
    picture = cv2.imread(materials.print_path(group["mat"].removeprefix("print:")), 0) / 255.0
    f = group["f"][faces]
    a, b, c = (group["v"][f[:, k], :2] for k in range(3))
    d = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (c[:, 0] - a[:, 0]) * (b[:, 1] - a[:, 1])
    d[np.abs(d) < 1e-9] = 1e-9
    x, y = points[:, 0], points[:, 1]
    wb = ((x - a[:, 0]) * (c[:, 1] - a[:, 1]) - (c[:, 0] - a[:, 0]) * (y - a[:, 1])) / d
    wc = ((b[:, 0] - a[:, 0]) * (y - a[:, 1]) - (x - a[:, 0]) * (b[:, 1] - a[:, 1])) / d
    wa = 1 - wb - wc
    at = group["uv"]
    uv = at[f[:, 0]] * wa[:, None] + at[f[:, 1]] * wb[:, None] + at[f[:, 2]] * wc[:, None]
    rows = np.clip(((1 - uv[:, 1]) * picture.shape[0]).astype(int), 0, picture.shape[0] - 1)
    cols = np.clip((uv[:, 0] * picture.shape[1]).astype(int), 0, picture.shape[1] - 1)
    return picture[rows, cols]


def plan_view(body, mm):
    """The plan view of a body with pixels of `mm`."""
    mesh = trimesh.Trimesh(body.tv, body.tf, process=False)
    x = (np.arange(CELL) - CELL / 2 + 0.5) * mm
    xs, ys = np.meshgrid(x, -x)
    origins = np.stack([xs, ys, np.full_like(xs, body.hi[2] + 5)], -1).reshape(-1, 3)
    hit = RayMeshIntersector(mesh).intersects_first(origins, np.broadcast_to([0, 0, -1.0], origins.shape))
    tri = body.tf[np.maximum(hit, 0)]
    v = body.tv[tri]
    n = np.cross(v[:, 1] - v[:, 0], v[:, 2] - v[:, 0])
    n[np.abs(n[:, 2]) < 1e-9] = [0, 0, 1]
    dx, dy = origins[:, 0] - v[:, 0, 0], origins[:, 1] - v[:, 0, 1]
    z = v[:, 0, 2] - (dx * n[:, 0] + dy * n[:, 1]) / n[:, 2]
    z = np.where(hit >= 0, np.clip(z, 0.05, body.hi[2]), 0)
    value = np.zeros(len(z))
    offset = 0
    for g in body.groups:
        own = (hit >= offset) & (hit < offset + len(g["f"]))
        if g["mat"].startswith("print:"):
            faces = np.clip(hit - offset, 0, len(g["f"]) - 1)
            value = np.where(own, print_values(g, faces, origins[:, :2]), value)
        else:
            value = np.where(own, materials.lightness(g["mat"]), value)
        offset += len(g["f"])
    return z.reshape(CELL, CELL).astype(np.float32), value.reshape(CELL, CELL).astype(np.float32)


def differs(a, b):
    """The pixels at which two plan views differ visibly."""
    step = np.abs(a[0] - b[0]) > MIN_STEP_MM
    outside = (a[0] > 0) != (b[0] > 0)
    value = (np.abs(a[1] - b[1]) > MIN_VALUE_STEP) & (a[0] > 0) & (b[0] > 0)
    d = (step | outside | value).astype(np.uint8)
    return cv2.morphologyEx(d, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)) > 0


def moved(view, turn, dx, dy):
    """A plan view rotated about its centre, in degrees counter-clockwise, and then shifted, in pixels."""
    m = cv2.getRotationMatrix2D((CELL / 2 - 0.5, CELL / 2 - 0.5), turn, 1)
    m[:, 2] += [dx, dy]
    return [cv2.warpAffine(x, m, (CELL, CELL), flags=cv2.INTER_NEAREST) for x in view]


def edges(view):
    slope = np.hypot(*np.gradient(np.minimum(view[0], 12) / 6 + view[1]))
    return cv2.GaussianBlur(slope, (0, 0), 1.5)


def best_cover(part, rival, turns):
    """(differing fraction, angle in degrees, dx, dy in pixels) of the best cover of the look-alike, over `turns`."""
    rival_area = np.fft.rfft2(rival[0] > 0)
    rival_edges = edges(rival)
    rival_edges_fft = np.fft.rfft2(rival_edges)
    out = []
    for turn in turns:
        view = moved(part, turn, 0, 0)
        area = np.fft.irfft2(np.fft.rfft2(view[0] > 0).conj() * rival_area, (CELL, CELL)) / (rival[0] > 0).sum()
        edge = np.fft.irfft2(np.fft.rfft2(edges(view)).conj() * rival_edges_fft, (CELL, CELL))
        score = area + EDGE_WEIGHT * edge / max(1e-6, (rival_edges**2).sum())
        dy, dx = np.unravel_index(np.argmax(score), score.shape)
        # The correlation is cyclic: shifts beyond the middle are negative.
        dy = (dy + CELL // 2) % CELL - CELL // 2
        dx = (dx + CELL // 2) % CELL - CELL // 2
        out.append((score[dy, dx], turn, dx, dy))
    _, turn, dx, dy = max(out)
    view = moved(part, turn, dx, dy)
    union = (view[0] > 0) | (rival[0] > 0)
    return differs(view, rival)[union].mean(), turn, dx, dy
