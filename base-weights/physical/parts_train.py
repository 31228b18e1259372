"""Random parts of the group `train`, which are used only for training the details network.

A part is a recipe (drawings_train.py), a dictionary of an outline and a list of features; a look-alike is the same
recipe with one thing changed, so the difference is known, and a new seed is a new part.
"""

import copy
import math

import numpy as np

from drawings_train import build
from meshes import lengthen, mirror

METALS = [
    "zinc",
    "steel",
    "alu",
    "tin",
    "copper",
    "brass",
    "brassplate",
    "bronze",
    "blackox",
    "anodblack",
    "anodblue",
    "cast",
    "galv",
]
COATINGS = ["plastic", "paint", "rubber", "board"]
# Repeated names are chosen more often.
OUTLINES = ["polygon", "polygon", "spline", "link", "disc", "tool", "ell", "ell", "rect", "rect", "rect", "bent"]
FEATURES = ["hole"] * 4 + ["slot", "pocket", "sink", "rib", "boss", "lug", "notch"]
TALL_FEATURES = FEATURES + ["fins", "boss", "rib"]
BENT_FEATURES = ["hole"] * 4 + ["slot", "notch"]
ADDED_FEATURES = ["hole", "slot", "pocket", "rib", "boss", "lug", "notch"]
ADDED_BENT_FEATURES = ["hole", "slot"]
PRINT_ELEMENTS = ["text", "text", "disc", "ring", "box", "frame", "line"]
LETTERS = "ABCDEFGHKLMNPRSTUVXZ"


def draw(rng, names):
    return names[rng.integers(len(names))]


def colour(rng, lo=0.03, hi=0.9):
    """An sRGB colour in the form that materials.py reads."""
    return ",".join(f"{v:.2f}" for v in rng.uniform(lo, hi, 3) ** 1.3)


def material(rng):
    kind = rng.random()
    if kind < 0.55:
        return draw(rng, METALS)
    if kind < 0.7:
        grey = rng.uniform(0.04, 0.85)
        return f"plastic:{grey:.2f},{grey:.2f},{grey:.2f}"
    return f"{draw(rng, COATINGS)}:{colour(rng)}"


def feature(rng, kind, lx, ly):
    """A feature somewhere on an outline of lx x ly mm; lugs and notches are at its edge."""
    small = min(lx, ly)
    f = dict(
        type=kind,
        x=float(rng.uniform(-0.4, 0.4) * lx),
        y=float(rng.uniform(-0.38, 0.38) * ly),
        turn=float(rng.uniform(0, 180)),
        deep=float(rng.random()),
    )
    if kind in ("lug", "notch"):
        side = rng.integers(4)
        f["turn"] = 0.0
        if side < 2:
            f["x"] = (lx / 2) * (1 if side else -1)
        else:
            f["y"] = (ly / 2) * (1 if side == 3 else -1)
        f["a"], f["b"] = (float(v) for v in rng.uniform(0.15, 0.4, 2) * small)
    elif kind in ("pocket", "rib", "fins"):
        f["a"], f["b"] = (float(v) for v in rng.uniform(0.15, 0.45, 2) * small)
        if kind == "rib" and rng.random() < 0.5:
            f["a"] = float(rng.uniform(1.2, 3))
        if kind == "rib" and rng.random() < 0.3:
            f["mat"] = material(rng)
    elif kind == "slot":
        f["b"] = float(rng.uniform(0.08, 0.2) * small)
        f["a"] = f["b"] * float(rng.uniform(1.6, 4))
    else:
        f["a"] = f["b"] = float(rng.uniform(0.1, 0.34) * small)
        if kind == "boss" and rng.random() < 0.3:
            f["mat"] = material(rng)
    return f


def element(rng, w, h):
    """A random element, without its ink, of a print of w x h mm."""
    size = float(rng.uniform(0.12, 0.45) * min(w, h))
    kind = draw(rng, PRINT_ELEMENTS)
    e = dict(
        type=kind,
        x=float(rng.uniform(-0.36, 0.36) * w),
        y=float(rng.uniform(-0.36, 0.36) * h),
        size=size,
        long=float(rng.uniform(0.6, 3)),
        turn=float(rng.integers(8) * 45),
    )
    if kind == "text":
        count = int(rng.integers(1, 6))
        e["text"] = "".join(draw(rng, LETTERS) if rng.random() < 0.5 else str(rng.integers(10)) for _ in range(count))
    return e


def tile(rng, w, h):
    """Dots in two halves, as on dominoes, or in a grid."""
    out = []
    if rng.random() < 0.5:
        places = [(a, c) for a in (-1, 0, 1) for c in (-1, 0, 1)]
        for half in (-1, 1):
            for k in rng.permutation(9)[: int(rng.integers(1, 7))]:
                a, c = places[k]
                x = half * w / 4 + a * w / 8
                out.append(dict(type="disc", x=x, y=c * h / 3.6, size=0.15 * h, long=1.0, turn=0.0))
        out.append(dict(type="line", x=0.0, y=0.0, size=h * 0.8, long=1.0, turn=90.0))
        return out
    nx, ny = int(rng.integers(3, 6)), int(rng.integers(2, 4))
    size = 0.5 * min(w / nx, h / ny)
    for i in range(nx):
        for j in range(ny):
            if rng.random() < 0.55:
                kind = draw(rng, ["disc", "box"])
                x = (i - (nx - 1) / 2) * w / nx * 0.9
                y = (j - (ny - 1) / 2) * h / ny * 0.9
                out.append(dict(type=kind, x=x, y=y, size=size, long=1.0, turn=0.0))
    return out


def printed_face(rng, lx, ly):
    """The `print` of a recipe: elements that are lighter than a dark ground or darker than a light one."""
    w = lx * float(rng.uniform(0.5, 1.1))
    h = ly * float(rng.uniform(0.5, 1.1))
    ground = rng.integers(20, 240, 3) if rng.random() < 0.5 else np.full(3, rng.integers(15, 245))
    if rng.random() < 0.4:
        elements = tile(rng, w, h)
    else:
        elements = [element(rng, w, h) for _ in range(int(rng.integers(2, 10)))]
    sign = 1 if ground.mean() < 128 else -1
    for e in elements:
        ink = ground + sign * rng.integers(60, 200) * rng.uniform(0.5, 1, 3)
        e["ink"] = [int(v) for v in np.clip(ink, 0, 255)]
    if rng.random() < 0.7:
        for e in elements:
            e["ink"] = elements[0]["ink"]
    return dict(size=(w, h), at=(0.0, 0.0), ground=[int(v) for v in ground], elements=elements)


def heights(rng, ly, is_tall):
    """Thickness of a part in mm, and the factor on raised features. The sides of tall parts are visible to the camera."""
    thin = float(rng.choice([1.5, 2.5, 4, 6, 9]) * rng.uniform(0.8, 1.2))
    if not is_tall:
        return thin, 1.0
    thick = float(np.clip(rng.uniform(0.3, 1.0) * ly, 8, 32))
    return (thick, float(rng.uniform(0.8, 2.0))) if rng.random() < 0.6 else (thin, float(rng.uniform(2.0, 4.5)))


def recipe(rng, is_tall=False):
    """A random recipe."""
    kind = draw(rng, OUTLINES)
    lx = float(rng.uniform(40, 80))
    ly = lx * float(rng.uniform(0.2, 0.4) if kind == "tool" else rng.uniform(0.3, 0.8))
    numbers = [float(v) for v in rng.random(int(rng.integers(6, 11)))]
    thick, rise = heights(rng, ly, is_tall)
    r = dict(
        outline=dict(kind=kind, size=(lx, ly), numbers=numbers),
        thick=thick,
        rise=rise,
        edge=float(rng.random()),
        mat=material(rng),
        features=[],
    )
    is_printed = kind in ("rect", "polygon", "disc") and rng.random() < 0.6
    wanted = BENT_FEATURES if kind == "bent" else TALL_FEATURES if is_tall else FEATURES
    count = int(rng.integers(0, 4) if is_printed else rng.integers(1, 8))
    for _ in range(count):
        r["features"].append(feature(rng, draw(rng, wanted), lx, ly))
    if is_printed:
        r["print"] = printed_face(rng, lx, ly)
    return r


def shift(rng, thing, size, shares, limit):
    """Moves a feature or an element by `shares` (from, to) of the diagonal of `size`, at most to `limit * size`."""
    a = rng.uniform(0, 2 * math.pi)
    d = rng.uniform(*shares) * math.hypot(*size)
    limit_x, limit_y = limit * size[0], limit * size[1]
    thing["x"] = float(np.clip(thing["x"] + d * math.cos(a), -limit_x, limit_x))
    thing["y"] = float(np.clip(thing["y"] + d * math.sin(a), -limit_y, limit_y))


def change_print(rng, q):
    """Changes the print of the recipe `q` in place; returns the difference in words."""
    size = q["print"]["size"]
    elements = q["print"]["elements"]
    k = int(rng.integers(len(elements)))
    ink = elements[0]["ink"]
    what = draw(rng, ["print moved", "print missing", "print added", "other print"])
    if what == "print moved":
        shift(rng, elements[k], q["outline"]["size"], (0.07, 0.2), 0.45)
    elif what == "print missing" and len(elements) > 1:
        elements.pop(k)
    elif what == "print added":
        elements.append(dict(element(rng, *size), ink=ink))
    else:
        what = "other print"
        new = tile(rng, *size) if rng.random() < 0.5 else [element(rng, *size) for _ in range(len(elements))]
        q["print"]["elements"] = [dict(e, ink=ink) for e in new]
    return what


def changed(rng, r):
    """A recipe with one change, and the difference in words."""
    q = copy.deepcopy(r)
    if q.get("print") and rng.random() < 0.7:
        what = change_print(rng, q)
        return q, what
    lx, ly = r["outline"]["size"]
    features = q["features"]
    choice = rng.random()
    if features and choice < 0.45:
        f = features[int(rng.integers(len(features)))]
        shift(rng, f, (lx, ly), (0.06, 0.16), 0.46)
        return q, f"{f['type']} moved"
    if features and choice < 0.7:
        f = features.pop(int(rng.integers(len(features))))
        return q, f"{f['type']} missing"
    if features and choice < 0.8:
        f = features[int(rng.integers(len(features)))]
        f["a"] *= float(rng.uniform(1.4, 1.9))
        f["b"] *= float(rng.uniform(1.4, 1.9))
        return q, f"{f['type']} larger"
    f = feature(rng, draw(rng, ADDED_BENT_FEATURES if r["outline"]["kind"] == "bent" else ADDED_FEATURES), lx, ly)
    features.append(f)
    return q, f"{f['type']} added"


def looks(rng, r, name, count):
    """Look-alikes (difference, draw): the mirror image, a longer part, and `count` parts with one change."""
    out = [("mirror image", lambda: mirror(build(r, name)))]
    lx = r["outline"]["size"][0]
    x = float(rng.uniform(-0.25, 0.15) * lx)
    width = 0.05 * lx
    factor = float(rng.uniform(1.1, 1.25))
    out.append((f"{factor - 1:.0%} longer", lambda: lengthen(build(r, name), x, x + width, factor)))
    for k in range(count):
        q, what = changed(rng, r)
        out.append((what, lambda q=q, k=k: build(q, f"{name}_{k}")))
    return out
