"""The camera's geometry, and visibility by ray casting.

Image axes: x to the right, y down, pixel centres at .5. World: mm, z up, the table at z = 0.
"""

import math

import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")

import trimesh  # noqa: E402 (Mitsuba's variant is set before anything else)
from shapely.geometry import MultiPoint, Polygon, box  # noqa: E402
from trimesh.ray.ray_pyembree import RayMeshIntersector  # noqa: E402

WIDTH, HEIGHT = 640, 480


class Camera:
    """A perspective camera with radial distortion (coefficient `k1`) that looks at `target` on the table.

    Its distance from the target is `height` (mm) times `dist`. In degrees: `fov` is the horizontal field of view, `tilt`
    the angle from the vertical, `azimuth` the tilt's direction, `roll` the rotation about the optical axis.
    """

    def __init__(self, height, fov, k1, tilt=0.0, azimuth=0.0, dist=1.0, target=(0, 0), roll=0.0):
        self.f = WIDTH / 2 / math.tan(math.radians(fov) / 2)
        self.k1 = k1
        t, a, r = math.radians(tilt), math.radians(azimuth), math.radians(roll)
        away = height * dist * np.array([math.sin(t) * math.cos(a), math.sin(t) * math.sin(a), math.cos(t)])
        self.target = np.array([*target, 0.0])
        self.pos = self.target + away
        self.to_world = mi.ScalarTransform4f().look_at(
            origin=[float(v) for v in self.pos],
            target=[float(v) for v in self.target],
            up=[-math.sin(r), math.cos(r), 0],
        )
        self.world_from_camera = np.array(self.to_world.matrix).reshape(4, 4)
        self.camera_from_world = np.linalg.inv(self.world_from_camera)

    def distort(self, x, y):
        s = 1 + self.k1 * (x * x + y * y)
        return x * s, y * s

    def undistort(self, x, y):
        u, v = x, y
        for _ in range(8):
            s = 1 + self.k1 * (u * u + v * v)
            u, v = x / s, y / s
        return u, v

    def project(self, p_in_world):
        """Pixels (N, 2) of points (N, 3)."""
        p = np.atleast_2d(p_in_world) @ self.camera_from_world[:3, :3].T + self.camera_from_world[:3, 3]
        x, y = self.distort(-p[:, 0] / p[:, 2], -p[:, 1] / p[:, 2])
        return np.stack([WIDTH / 2 + self.f * x, HEIGHT / 2 + self.f * y], 1)

    def depth(self, p_in_world):
        return float((np.asarray(p_in_world) @ self.camera_from_world[:3, :3].T + self.camera_from_world[:3, 3])[2])

    def directions(self, u, v):
        """Directions in the world, not normalised, of the rays through pixels."""
        x, y = self.undistort((u - WIDTH / 2) / self.f, (v - HEIGHT / 2) / self.f)
        return np.stack([-x, -y, np.ones_like(x)], -1) @ self.world_from_camera[:3, :3].T

    def table(self, margin):
        """Visible polygon of the table, without a margin in pixels."""
        u = np.array([margin, WIDTH - margin, WIDTH - margin, margin], float)
        v = np.array([margin, margin, HEIGHT - margin, HEIGHT - margin], float)
        d = self.directions(u, v)
        return Polygon((self.pos - (self.pos[2] / d[:, 2])[:, None] * d)[:, :2])


def cast(cam, items, step):
    """Index of the nearest item (body, world_from_body) at every `step`-th pixel, -1 for the table."""
    u, v = np.meshgrid(np.arange(0, WIDTH, step) + step / 2, np.arange(0, HEIGHT, step) + step / 2)
    d = cam.directions(u, v).reshape(-1, 3)
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    if not items:
        return np.full(u.shape, -1)
    vertices, triangles, owner, offset = [], [], [], 0
    for k, (body, m) in enumerate(items):
        vertices.append(body.tv @ m[:3, :3].T + m[:3, 3])
        triangles.append(body.tf + offset)
        owner.append(np.full(len(body.tf), k))
        offset += len(body.tv)
    mesh = trimesh.Trimesh(np.vstack(vertices), np.vstack(triangles), process=False)
    hit = RayMeshIntersector(mesh).intersects_first(np.broadcast_to(cam.pos, d.shape), d)
    return np.where(hit >= 0, np.concatenate(owner)[np.maximum(hit, 0)], -1).reshape(u.shape)


def hidden(cam, items, ids, step=2):
    """For each index: the fractions covered by other items, outside the picture, and invisible in total."""
    seen = cast(cam, items, step)
    frame = box(0, 0, WIDTH, HEIGHT)
    out = []
    for k in ids:
        body, m = items[k]
        alone = cast(cam, [items[k]], step) == 0
        hull = MultiPoint(cam.project(body.hull.vertices @ m[:3, :3].T + m[:3, 3])).convex_hull
        inside = hull.intersection(frame).area / max(hull.area, 1e-9)
        covered = 1 - ((seen == k) & alone).sum() / max(1, alone.sum())
        out.append((float(covered), float(1 - inside), float(1 - (1 - covered) * inside)))
    return out
