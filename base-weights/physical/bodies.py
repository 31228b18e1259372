"""Bodies ready for ray casting and physics, their grasp lines and their poses on the table."""

import numpy as np
import trimesh
from shapely.geometry import MultiPoint

import meshes


class Body:
    """A mesh with its convex hull. `tv`, `tf` are vertices and triangles of all groups together."""

    all = {}

    def __init__(self, key, make):
        self.key = key
        self.groups = [g for g in meshes.cached(key, make) if len(g["f"])]
        self.v = meshes.verts(self.groups)
        self.lo, self.hi = self.v.min(0), self.v.max(0)
        self.size = self.hi - self.lo
        self.hull = trimesh.Trimesh(self.v, process=False).convex_hull
        offsets = np.cumsum([0] + [len(g["v"]) for g in self.groups])
        self.tv = np.vstack([g["v"] for g in self.groups])
        self.tf = np.vstack([g["f"] + o for g, o in zip(self.groups, offsets)])

    @staticmethod
    def get(key, make):
        if key not in Body.all:
            Body.all[key] = Body(key, make)
        return Body.all[key]

    def top(self, x, y):
        """Height of the upper face at (x, y), or None beside the body."""
        a, b, c = (self.tv[self.tf[:, k]] for k in range(3))
        d = (b[:, 1] - c[:, 1]) * (a[:, 0] - c[:, 0]) + (c[:, 0] - b[:, 0]) * (a[:, 1] - c[:, 1])
        ok = np.abs(d) > 1e-9
        d = np.where(ok, d, 1)
        wa = ((b[:, 1] - c[:, 1]) * (x - c[:, 0]) + (c[:, 0] - b[:, 0]) * (y - c[:, 1])) / d
        wb = ((c[:, 1] - a[:, 1]) * (x - c[:, 0]) + (a[:, 0] - c[:, 0]) * (y - c[:, 1])) / d
        wc = 1 - wa - wb
        hit = ok & (wa >= -1e-6) & (wb >= -1e-6) & (wc >= -1e-6)
        z = (wa * a[:, 2] + wb * b[:, 2] + wc * c[:, 2])[hit]
        return z.max() if len(z) else None


def grasp_ends(body, spec):
    """Ends (2, 3) of the grasp line in the body's frame, on the body's upper face.

    A part of revolution has the line on its axis, and `lift` moves it to the upper side. Without `grasp` in the spec the line
    is a third of the body's length, along x; for a part without symmetry it is at the y nearest to the middle where the
    body is solid and not low under both ends.
    """
    if spec.get("roll"):
        return np.array([[-body.size[0] / 6, 0, 0], [body.size[0] / 6, 0, 0]])
    if spec.get("grasp"):
        x0, y0, x1, y1 = spec["grasp"]
    else:
        x0, x1, y0 = -body.size[0] / 6, body.size[0] / 6, 0.0
        if spec.get("sym", 1) == 1:
            floor = 0.25 * body.size[2] if body.size[2] >= 5 else 0.0
            for d in np.linspace(0, body.size[1] * 0.35, 15):
                good = [y for y in (d, -d) if all((body.top(x, y) or 0) > floor for x in (x0, x1))]
                if good:
                    y0 = good[0]
                    break
        y1 = y0
    heights = [body.top(x, y) for x, y in ((x0, y0), (x1, y1))]
    heights = [z for z in heights if z] or [body.hi[2]]
    return np.array([[x0, y0, np.mean(heights)], [x1, y1, np.mean(heights)]])


def lift(body, spec):
    """Height of the upper side of a part of revolution above its axis, near the grasp line; 0 for other parts."""
    if not spec.get("roll"):
        return 0.0
    near = np.abs(body.v[:, 0]) < body.size[0] / 6
    return float(np.hypot(body.v[:, 1], body.v[:, 2])[near].max())


def rest(angle, x, y):
    """world_from_body of a body on the table, rotated by `angle` degrees."""
    m = meshes.rot("z", angle)
    m[:3, 3] = [x, y, 0.06]
    return m


def lying(body, angle, roll, x, y):
    """world_from_body of a part of revolution at rest on two contact points, rolled by `roll` degrees about its axis."""
    m = meshes.rot("x", roll)
    side = (body.hull.vertices @ m[:3, :3].T)[:, [0, 2]]
    q = np.array(MultiPoint(side).convex_hull.exterior.coords)
    center = body.hull.center_mass[0]
    for (x0, z0), (x1, z1) in zip(q[:-1], q[1:]):
        if min(x0, x1) <= center <= max(x0, x1) and (z0 + z1) / 2 < side[:, 1].mean():
            m = meshes.rot("y", np.degrees(np.arctan2((z1 - z0) * np.sign(x1 - x0), abs(x1 - x0)))) @ m
            break
    low = (body.hull.vertices @ m[:3, :3].T)[:, 2].min()
    m[2, 3] = -low
    return rest(angle, x, y) @ m


def footprint(body, m):
    return MultiPoint((body.hull.vertices @ m[:3, :3].T + m[:3, 3])[:, :2]).convex_hull
