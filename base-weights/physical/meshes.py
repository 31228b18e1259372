"""Meshes of parts.

A body is a list of groups, one per material. A group is a dict:

  v    (N, 3)  vertices in mm          n    (N, 3)  unit normals, smooth inside a CAD face, sharp between faces
  f    (M, 3)  triangles               uv   (N, 2)  texture coordinates, 50 mm per tile
  mat          name of a material in `materials.py`
"""

import os
import pickle

import numpy as np

CACHE = os.environ.get("PHYS_CACHE", "scratch/cache")


def face_mesh(v, f):
    """Returns (v, f, n, uv) of one CAD face: vertex normals and box-projected texture coordinates."""
    v = np.asarray(v, float)
    f = np.asarray(f, int)
    cross = np.cross(v[f[:, 1]] - v[f[:, 0]], v[f[:, 2]] - v[f[:, 0]])
    keep = np.linalg.norm(cross, axis=1) > 1e-12
    f, cross = f[keep], cross[keep]
    n = np.zeros_like(v)
    for k in range(3):
        np.add.at(n, f[:, k], cross)
    n /= np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-12)
    area = np.abs(cross.sum(0))
    axis = int(np.argmax(area)) if area.sum() > 0 else 2
    return v, f, n, v[:, [[1, 2], [0, 2], [0, 1]][axis]] / 50.0


def join(faces, mat):
    """Joins (v, f, n, uv) tuples to one group."""
    v, f, n, uv, offset = [], [], [], [], 0
    for a, b, c, d in faces:
        if len(b):
            v.append(a)
            f.append(b + offset)
            n.append(c)
            uv.append(d)
            offset += len(a)
    return dict(v=np.vstack(v), f=np.vstack(f), n=np.vstack(n), uv=np.vstack(uv), mat=mat)


def cad(shape, mat="steel", tolerance=0.04, angle=0.2):
    """Tessellates a build123d shape. `mat` is a material's name, or a function of the face that returns one."""
    groups = {}
    for face in shape.faces():
        vertices, triangles = face.tessellate(tolerance, angle)
        if triangles:
            name = mat(face) if callable(mat) else mat
            groups.setdefault(name, []).append(face_mesh([(p.X, p.Y, p.Z) for p in vertices], triangles))
    return [join(faces, name) for name, faces in groups.items()]


def transform(groups, m):
    """Applies a 4 x 4 matrix; a mirroring one reverses the triangles."""
    m = np.asarray(m, float)
    a = m[:3, :3]
    normal_matrix = np.linalg.inv(a).T
    out = []
    for g in groups:
        n = g["n"] @ normal_matrix.T
        n /= np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-12)
        f = g["f"][:, ::-1].copy() if np.linalg.det(a) < 0 else g["f"]
        out.append(dict(g, v=g["v"] @ a.T + m[:3, 3], n=n, f=f))
    return out


def rot(axis, deg):
    """Rotation about a coordinate axis as a 4 x 4 matrix."""
    c, s = np.cos(np.radians(deg)), np.sin(np.radians(deg))
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    m = np.eye(4)
    m[i, i] = m[j, j] = c
    m[i, j], m[j, i] = -s, s
    return m


def scale(x, y, z):
    return np.diag([x, y, z, 1.0])


def verts(groups):
    return np.vstack([g["v"][np.unique(g["f"])] for g in groups])


def settle(groups):
    """Moves the centre of the bounding box to x = y = 0 and its bottom to z = 0."""
    v = verts(groups)
    lo, hi = v.min(0), v.max(0)
    m = np.eye(4)
    m[:3, 3] = [-(lo[0] + hi[0]) / 2, -(lo[1] + hi[1]) / 2, -lo[2]]
    return transform(groups, m)


def mirror(groups):
    """The mirror image; for a flat part, the view of its lower side."""
    return settle(transform(groups, scale(1, -1, 1)))


def lengthen(groups, x0, x1, factor=1.2):
    """Makes a body longer by stretching only the region x0 < x < x1; the rest keeps its shape."""
    x = verts(groups)[:, 0]
    add = (factor - 1) * (x.max() - x.min())

    def moved(v):
        x = v[:, 0]
        t = np.clip((x - x0) / (x1 - x0), 0, 1)
        return np.column_stack([x + t * add, v[:, 1:]])

    return settle([dict(g, v=moved(g["v"])) for g in groups])


def cached(name, make):
    """Returns make(), kept in a file of the cache folder."""
    os.makedirs(CACHE, exist_ok=True)
    path = os.path.join(CACHE, name + ".pkl")
    if os.path.exists(path):
        with open(path, "rb") as f:
            return pickle.load(f)
    groups = make()
    with open(path + ".tmp", "wb") as f:
        pickle.dump(groups, f)
    os.replace(path + ".tmp", path)
    return groups
