"""Draws the random parts of the group `train` from their recipes.

A recipe is a dictionary, made by `parts_train.py`; lengths are in mm, angles in degrees, and the part lies on z = 0:

    outline   kind, size (x, y) and `numbers`, 6 to 10 random numbers from 0 to 1 that shape the outline of the kind
    thick     height in z; the thickness of a bent part comes from its numbers
    rise      factor on the heights of ribs, bosses, fins and bends
    edge      size of the chamfer at the upper edges, 0 to 1
    mat       material (materials.py)
    features  list of dictionaries: type, x, y, lengths a and b, turn, deep (0 to 1), possibly mat
    print     absent, or size, place `at`, colour `ground` and elements of the printed face
"""

import math

import build123d as b

from drawing import bar, block, disc, link, polygon, post, profile, rounded, slot, spline
from meshes import cad, settle, verts
from prints import Print

THROUGH = 80  # mm, more than the height of any part


def polygon_outline(n, lx, ly):
    """A star-shaped polygon with rounded corners."""
    points = []
    for k in range(len(n)):
        angle = 2 * math.pi * (k + 0.35 * (n[k] - 0.5)) / len(n)
        radius = 0.55 + 0.45 * n[-k - 1]
        points.append((lx / 2 * radius * math.cos(angle), ly / 2 * radius * math.sin(angle)))
    return rounded(polygon(*points), 1 + 3 * n[0])


def spline_outline(n, lx, ly):
    points = []
    for k, v in enumerate(n):
        angle = 2 * math.pi * k / len(n)
        radius = 0.6 + 0.4 * v
        points.append((lx / 2 * radius * math.cos(angle), ly / 2 * radius * math.sin(angle)))
    return spline(*points)


def link_outline(n, lx, ly):
    """A lever of two discs, possibly with a second arm."""
    left = -lx / 2 + ly / 3
    s = link((left, 0, ly / 3), (lx / 2 - ly / 4, (n[0] - 0.5) * ly * 0.5, ly / 6 + n[1] * ly / 6))
    if n[2] > 0.5:
        end = (-lx / 5 + n[3] * lx / 4, ly * (0.5 + 0.3 * n[4]), ly / 8 + n[5] * ly / 10)
        s = s + link((left, 0, ly / 4), end)
    return s


def disc_outline(n, lx, ly):
    """A disc, possibly with a bar on the right and a notch below."""
    s = disc(0, 0, ly / 2)
    if n[0] > 0.4:
        s = s + bar(ly / 2, 0, ly * (0.3 + 0.5 * n[1]), ly * (0.2 + 0.3 * n[2]))
    if n[3] > 0.5:
        s = s - bar(0, -ly / 2, ly * (0.2 + 0.4 * n[4]), ly * (0.1 + 0.15 * n[5]))
    return s


def tool_outline(n, lx, ly):
    """A handle with a slotted head, like a spanner."""
    s = bar(0, 0, lx, ly * 0.35) + disc(lx / 2 - ly / 3, (n[0] - 0.5) * ly * 0.3, ly / 2)
    mouth = (ly * (0.4 + 0.4 * n[2]), ly * (0.25 + 0.2 * n[3]))
    s = s - bar(lx / 2, (n[1] - 0.5) * ly * 0.5, *mouth, 40 * (n[4] - 0.5))
    if n[5] > 0.4:
        s = s + disc(-lx / 2, 0, ly * (0.25 + 0.15 * n[5]))
    return s


def ell_outline(n, lx, ly):
    """An L, possibly with a third bar."""
    w = ly * (0.25 + 0.25 * n[0])
    s = bar(0, -ly / 2 + w / 2, lx, w) + bar(-lx / 2 + w / 2, 0, w * (0.8 + 0.6 * n[1]), ly)
    if n[2] > 0.5:
        s = s + bar(lx / 2 - w / 2, -ly / 4 + n[3] * ly / 6, w * (0.6 + 0.5 * n[4]), ly / 2)
    return rounded(s, 0.5 + 2.5 * n[5])


def rect_outline(n, lx, ly):
    return rounded(bar(0, 0, lx, ly), 0.3 + ly * 0.25 * n[0] ** 2)


OUTLINES = dict(
    polygon=polygon_outline,
    spline=spline_outline,
    link=link_outline,
    disc=disc_outline,
    tool=tool_outline,
    ell=ell_outline,
    rect=rect_outline,
)


def outline(r):
    """The sketch of a recipe's outline, with lugs and notches; not for bent parts."""
    s = OUTLINES[r["outline"]["kind"]](r["outline"]["numbers"], *r["outline"]["size"])
    for f in r["features"]:
        if f["type"] == "lug":
            s = s + bar(f["x"], f["y"], f["a"], f["b"], f["turn"])
        elif f["type"] == "notch":
            s = s - bar(f["x"], f["y"], f["a"], f["b"], f["turn"])
    return s


def bent(r):
    """A bent sheet (one or two bends) with its notches, and the thickness of the sheet."""
    lx, ly = r["outline"]["size"]
    n = r["outline"]["numbers"]
    up = (4 + 14 * n[0]) * r["rise"]
    w = 1.2 + 1.5 * n[1]
    x0 = -lx / 2 + lx * (0.45 + 0.3 * n[2])
    if n[3] > 0.5:
        points = [(-lx / 2, 0), (x0, 0), (x0, up), (lx / 2, up)]
        points += [(lx / 2, up + w), (x0 - w, up + w), (x0 - w, w), (-lx / 2, w)]
    else:
        points = [(-lx / 2, 0), (lx / 2, 0), (lx / 2, up), (lx / 2 - w, up), (lx / 2 - w, w), (-lx / 2, w)]
    solid = profile(points, ly)
    for f in r["features"]:
        if f["type"] == "notch":
            solid = solid - block(f["x"], f["y"], -1, f["a"], f["b"], 60)
    return solid, w


def draw_print(name, r):
    """Draws the picture of a recipe's printed face and saves it as the print `name`."""
    p = r["print"]
    sheet = Print(*p["size"], tuple(p["ground"]))
    for e in p["elements"]:
        ink = tuple(e["ink"])
        x, y, size = e["x"], e["y"], e["size"]
        if e["type"] == "text":
            sheet.text(x, y, e["text"], size, ink)
        elif e["type"] == "disc":
            sheet.disc(x, y, size / 2, fill=ink)
        elif e["type"] == "ring":
            sheet.disc(x, y, size / 2, outline=ink, width=size / 6)
        elif e["type"] == "box":
            sheet.box(x, y, size * e["long"], size * 0.6, fill=ink, r=0.1)
        elif e["type"] == "frame":
            sheet.box(x, y, size * e["long"], size, outline=ink, width=0.4)
        else:
            angle = math.radians(e["turn"])
            half = size * e["long"] / 2
            dx, dy = half * math.cos(angle), half * math.sin(angle)
            sheet.line([(x - dx, y - dy), (x + dx, y + dy)], ink, 0.5)
    sheet.save(name)


def carve_and_raise(r, solid, t):
    """The solid with pockets and sinks, and its ribs, fins and bosses as (solid, material); `t` is its thickness."""
    raised = []
    for f in r["features"]:
        x, y, a, c = f["x"], f["y"], f["a"], f["b"]
        floor = t * (1 - 0.3 - 0.5 * f["deep"])
        if f["type"] == "pocket":
            solid = solid - block(x, y, floor, a, c, 40)
        elif f["type"] == "sink":
            solid = solid - post(x, y, floor, a / 2, 40)
        elif f["type"] == "rib":
            high = t * 0.5 + (1 + 4 * f["deep"]) * r["rise"]
            raised.append((block(x, y, t * 0.5, a, c, high), f.get("mat") or r["mat"]))
        elif f["type"] == "fins":
            high = t * 0.5 + (2 + 4 * f["deep"]) * r["rise"]
            count = 3 + int(f["turn"] / 40)
            for k in range(count):
                raised.append((block(x + a * (k / (count - 1) - 0.5), y, t * 0.5, a / count / 2, c, high), r["mat"]))
        elif f["type"] == "boss":
            s = post(x, y, t * 0.5, a / 2, t * 0.5 + (1 + 5 * f["deep"]) * r["rise"])
            if f["turn"] > 60:
                s = s - post(x, y, 0, a / 4, 60)
            raised.append((s, f.get("mat") or r["mat"]))
    return solid, raised


def through_cut(f):
    """The solid that a hole or slot removes."""
    if f["type"] == "hole":
        return post(f["x"], f["y"], -1, f["a"] / 2, THROUGH)
    s = slot(f["x"], f["y"], max(f["a"], f["b"] * 1.3), f["b"], f["turn"])
    return b.Pos(0, 0, -1) * b.extrude(s, THROUGH)


def build(r, name):
    """The groups (meshes with materials) of a recipe; `name` names its print."""
    is_bent = r["outline"]["kind"] == "bent"
    if is_bent:
        solid, t = bent(r)
    else:
        t = r["thick"]
        solid = b.extrude(outline(r), t)
    solid, extra = carve_and_raise(r, solid, t)
    if r.get("print"):
        label = block(*r["print"]["at"], t, *r["print"]["size"], 0.08)
        if not is_bent:
            label = label & b.extrude(outline(r), t + 1)
        extra.append((label, f"print:{name}"))
    for f in r["features"]:
        if f["type"] in ("hole", "slot"):
            cut = through_cut(f)
            solid = solid - cut
            extra = [(s - cut if m.startswith("print") else s, m) for s, m in extra]
    if not is_bent:
        try:
            solid = b.chamfer(solid.edges().group_by(b.Axis.Z)[-1], 0.25 + 0.3 * r["edge"])
        except Exception:  # OpenCASCADE raises several types of exception if a chamfer does not fit
            pass
    groups = []
    for s, m in [(solid, r["mat"]), *extra]:
        made = cad(s, m)
        if m.startswith("print:"):
            draw_print(name, r)
            for g in made:
                g["uv"] = (g["v"][:, :2] - r["print"]["at"]) / r["print"]["size"] + 0.5
        groups += made
    if not groups or len(verts(groups)) < 8:
        raise ValueError("nothing is left")
    return settle(groups)
