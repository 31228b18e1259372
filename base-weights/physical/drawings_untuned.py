"""Drawings of the parts in `parts_untuned.py`."""

import math

import build123d as b
import numpy as np

import prints
from drawing import (
    bar,
    block,
    body,
    disc,
    drill,
    edged,
    link,
    plate,
    polygon,
    post,
    profile,
    ring_of,
    rounded,
    spline,
    wire,
)
from meshes import cad, scale, settle, transform
from surfaces import letters


def polar(r, deg):
    return r * math.cos(math.radians(deg)), r * math.sin(math.radians(deg))


def arc_slot(r, width, start, end, x=0.0, y=0.0):
    """A slot along an arc about (x, y)."""
    turns = np.linspace(start, end, 13)
    points = [polar(r + width / 2, a) for a in turns] + [polar(r - width / 2, a) for a in turns[::-1]]
    s = polygon(*[(x + px, y + py) for px, py in points])
    for a in (start, end):
        px, py = polar(r, a)
        s = s + disc(x + px, y + py, width / 2)
    return s


def nameplate(name="u_nameplate", seed=611, ink=(24, 36, 92), holes=((-29, 0, 1.8), (29, 0, 1.8))):
    w, h, t = 68, 36, 1.2
    rng = np.random.default_rng(seed)
    p = prints.Print(w, h, (205, 206, 202))
    p.box(0, 0, w - 2.4, h - 2.4, outline=ink, width=0.5, r=2.5)
    p.box(-4, 11, 44, 8, fill=ink, r=1)
    p.text(-4, 11, letters(rng, 4) + " " + letters(rng, 5), 5.4, (225, 226, 222))
    for k in range(3):
        y = 3 - 5.2 * k
        p.text(-16, y, letters(rng, 4), 3.2, ink)
        p.box(4, y, 20, 4, outline=ink, width=0.3)
        p.text(4, y, str(rng.integers(100, 99999)), 3.0, ink)
    if rng.random() < 0.5:
        p.shape([(18, -6), (26, -6), (22, 2)], (230, 170, 20))
    else:
        p.disc(22, -2, 4.2, fill=(190, 40, 30))
    x = -24.0
    while x < 24:
        width = rng.uniform(0.3, 1.0)
        p.box(x, -13.6, width, 3.2, fill=ink)
        x += width + rng.uniform(0.4, 1.1)
    p.save(name)
    s = plate(rounded(bar(0, 0, w, h), 4), t, holes, edge=0)
    groups = cad(s, lambda f: f"print:{name}" if f.center().Z > t - 0.01 else "alu")
    return settle(prints.on_top(groups, name, w, h))


HINGE_HOLES = [(-19, -6, 2.4), (-1, -10, 2.4), (19, -4, 2.4)]


def hinge_leaf(holes=HINGE_HOLES, knuckles=((-28, -16), (-5, 7))):
    leaf = rounded(polygon((-28, 14), (-28, -15), (28, -15), (28, 14)), 3)
    s = plate(leaf, 2, holes, edge=0.2) - block(0, 18, -1, 70, 15, 10)
    for x0, x1 in knuckles:
        barrel = b.Pos((x0 + x1) / 2, 14, 3.6) * b.Rot(0, 90, 0) * b.Cylinder(3.6, x1 - x0)
        s = s + block((x0 + x1) / 2, 11.5, 0, x1 - x0, 5, 2) + barrel
    return body((s - b.Pos(0, 14, 3.6) * b.Rot(0, 90, 0) * b.Cylinder(1.7, 90), "steel"))


def ratchet(holes=tuple(ring_of(4, 15.5, 4.0, 20)), teeth=16, size=1.0):
    points = []
    for k in range(teeth):
        for share, r in ((0, 28), (0.08, 22.5), (0.4, 23.5), (0.7, 25.5)):
            points.append(polar(r, -360 * (k + share) / teeth))
    s = plate(polygon(*points) - disc(0, 0, 6), 6, holes, edge=0)
    s = s + plate(disc(0, 0, 9.5) - disc(0, 0, 6), 10, edge=0.5)
    return settle(transform(cad(s, "blackox"), scale(size, size, size)))


PAWL_HOLES = [(-21, -2, 3.6), (2, 4, 1.9)]


def pawl(holes=PAWL_HOLES, tail=True):
    s = link((-21, -2, 9), (8, 4, 6)) + polygon((4, 9.9), (22, 9), (33, -9), (24, -6), (14, -1.5), (2, -3))
    if tail:
        s = s + rounded(polygon((-22, 0), (-14, 4), (-24, 17), (-31, 14)), 1.5)
    return body((plate(s, 5, holes, edge=0.4), "tin"))


STRIKE_HOLES = [(-29, 0, 2.5), (29, 0, 2.5)]


def strike_plate(holes=STRIKE_HOLES, window=(-8, 0, 24, 11), small=(15.5, 2, 9, 6)):
    s = rounded(bar(0, 0, 72, 24), 5) + rounded(bar(-8, 11, 28, 14), 4)
    s = plate(s - rounded(bar(*window), 1), 2, holes, edge=0.3)
    if small:
        s = s - b.extrude(bar(*small), 10, both=True)
    for x, y, r in holes:
        s = s - b.Pos(x, y, 1.2) * b.Cone(r, r + 1.6, 1.7)
    return body((s, "brassplate"))


GUSSET_HOLES = [(-30, -16, 2.7), (-9, -16, 2.7), (27, -16, 2.7), (-30, 15, 2.7)]


def gusset(holes=GUSSET_HOLES, window=True):
    s = rounded(polygon((-37, -23), (37, -23), (37, -13), (-22, 26), (-37, 26)), 2)
    if window:
        s = s - rounded(polygon((-23, -9), (9, -9), (-23, 11)), 2)
    return body((plate(s, 4, holes, edge=0.5), "anodblue"))


def motor_plate(holes=tuple(ring_of(4, 28.3, 2.6, 45)), size=1.0):
    s = plate(rounded(bar(0, 0, 56, 56), 6) - disc(0, 0, 15), 4.5, holes, edge=0.4)
    s = s + plate(disc(0, 0, 19) - disc(0, 0, 15), 8, edge=0.5)
    return settle(transform(cad(s, "plastic:0.9,0.42,0.1"), scale(size, size, size)))


def impeller(vanes=8, holes=((17.5, 0, 2.6), (-17.5, 0, 2.6))):
    s = plate(disc(0, 0, 31), 2.5, edge=0.3)
    path = [(10 + 20 * t, 55 * t**1.2) for t in np.linspace(0, 1, 9)]
    center = np.array([polar(r, a) for r, a in path])
    d = np.gradient(center, axis=0)
    normal = np.column_stack([-d[:, 1], d[:, 0]]) / np.linalg.norm(d, axis=1, keepdims=True)
    vane = polygon(*(center + normal), *(center - normal)[::-1])
    for k in range(vanes):
        s = s + b.Rot(0, 0, 360 * (k + 0.5) / vanes) * b.extrude(vane, 11)
    s = s + edged(post(0, 0, 0, 9, 13), 0.8)
    return body((drill(s, [(0, 0, 3.5), *holes]), "plastic:0.62,0.66,0.68"))


def crank(hub_hole=True, handle="0.75,0.1,0.08", bend=9):
    s = plate(link((-34, 0, 10), (2, bend, 6)) + link((2, bend, 6), (34, -3, 7.5)), 7, edge=1.0)
    s = s + edged(post(-34, 0, 0, 12, 15), 1.0)
    if hub_hole:
        s = drill(s, [(-34, 0, 5)]) - block(-34, 4.5, -5, 3.5, 5, 60)
    grip = edged(post(34, -3, 8, 7.5, 22), 3.0)
    return body((s, "paint:0.16,0.17,0.18"), (post(34, -3, 7, 4, 2), "steel"), (grip, f"plastic:{handle}"))


BELL_HOLES = [(-16, -12, 5), (36, -12, 2.9), (-16, 23, 2.6), (-8, 3, 1.6)]


def bell_crank(holes=BELL_HOLES):
    s = link((-16, -12, 10), (36, -12, 6.5)) + link((-16, -12, 10), (-16, 23, 6))
    s = s + polygon((-12, 6), (10, -7), (-8, -8))
    s = plate(s, 4, holes, edge=0.5) + plate(disc(-16, -12, 9) - disc(-16, -12, 5), 8, edge=0.5)
    return body((s, "paint:0.7,0.12,0.1"))


def barrier_strip(poles=5, screws=True, ear_hole=True, colour="0.75,0.15,0.1"):
    pitch, dark = 9.5, "plastic:0.13,0.13,0.14"
    length = poles * pitch + 2
    s = block(0, 0, 0, length, 20, 7)
    for k in range(poles + 1):
        s = s + block((k - poles / 2) * pitch, 0, 7, 2, 20, 6)
    s = s + block(-length / 2 - 4, 0, 0, 9, 14, 4) + block(length / 2 + 2.5, 0, 0, 6, 20, 9)
    s = s - post(-length / 2 - 4, 0, -5, 2, 40) if ear_hole else s
    out = [(s, dark), (block(length / 2 + 2.5, 0, 9, 6, 20, 0.6), f"plastic:{colour}")]
    for k in range(poles):
        x = (k - (poles - 1) / 2) * pitch
        out.append((block(x, 4.5, 7, 7, 9, 0.8), "tin"))
        if screws:
            out.append((post(x, 5, 7.8, 2.9, 2.2) - block(x, 5, 9.2, 5, 0.9, 3), "brass"))
    return body(*out)


def display(name="u_display", seed=73, text="27.4", unit="C", mark=None, header=True):
    w, h, t = 70, 40, 1.6
    rng = np.random.default_rng(seed)
    prints.board(name, seed, w, h, mask=(22, 40, 96), mark=mark, drills=[(-32, -17, 1.6), (32, 17, 1.6)])
    face = prints.Print(w, h, (24, 46, 20))
    face.box(-2, -2, 50, 19, fill=(136, 160, 70))
    face.text(-6, -2, text, 14, (24, 34, 20))
    face.text(17, 2, unit, 7, (24, 34, 20))
    face.box(16, -8, 2 + 8 * rng.random(), 2, fill=(24, 34, 20))
    face.save(name + "_face")
    holes = [(-32, -17, 1.6), (32, 17, 1.6)]
    blank = plate(rounded(bar(0, 0, w, h), 1.5), t, holes, edge=0)
    groups = cad(blank, lambda f: f"print:{name}" if f.center().Z > t - 0.01 else "board:0.1,0.18,0.42")
    groups = prints.on_top(groups, name, w, h)
    frame = block(-2, -2, t, 58, 26, 6, 1.0) - block(-2, -2, t + 4, 51, 19.5, 10)
    groups += cad(frame, "blackox")
    glass = b.Pos(-2, -2, t + 4.5) * b.Box(51, 19.5, 1)
    groups += prints.on_top(
        cad(glass, lambda f: f"print:{name}_face" if f.normal_at().Z > 0.9 else "plastic:0.1,0.1,0.1"),
        name + "_face",
        w,
        h,
    )
    if header:
        groups += cad(block(-13, 16.5, t, 12 * 2.54, 2.5, 2.5), "plastic:0.1,0.1,0.1")
        for k in range(12):
            groups += cad(block(-13 + (k - 5.5) * 2.54, 16.5, t, 0.64, 0.64, 8), "brass")
    return settle(groups)


def keypad(name="u_keypad", keys="123A456B789C", red=3, colour=(150, 34, 30)):
    w, h, t = 62, 48, 2.2
    p = prints.Print(w, h, (88, 92, 98))
    s = block(0, 0, 0, w, h, t, 3)
    for k, text in enumerate(keys):
        x, y = (k % 4 - 1.5) * 13.5, (1 - k // 4) * 13.5
        p.box(x, y, 13, 13, fill=colour if k == red else (58, 62, 68))
        p.text(x, y, text, 6.5, (230, 230, 224))
        s = s + edged(block(x, y, t, 10, 9, 3.2, 1.2), 0.5)
    s = drill(s, [(-27.5, 20.8, 1.3), (27.5, -20.8, 1.3)])
    p.save(name)
    groups = cad(s, lambda f: f"print:{name}" if f.center().Z > t + 3.1 and f.area > 20 else "rubber:0.34,0.35,0.37")
    return settle(prints.on_top(groups, name, w, h))


def snap_ring(ear_holes=2, gap=52, size=1.0):
    s = disc(0, 0, 27) - disc(0, 1.2, 22.6)
    s = s - polygon((0, 0), polar(60, 90 - gap / 2), polar(60, 90 + gap / 2))
    for k, side in enumerate((-1, 1)):
        x, y = polar(24.5, 90 + side * (gap / 2 + 5))
        s = s + disc(x, y, 5)
        s = s - disc(x, y, 2) if k < ear_holes else s
    return settle(transform(cad(plate(s, 2, edge=0.2), "blackox"), scale(size, size, size)))


IDLER_HOLES = [(-29, -9, 4.2), (-2, -4, 2.2)]


def idler_arm(holes=IDLER_HOLES, roller=True, arc=(-6, 26)):
    s = link((-29, -9, 9), (24, 17, 7), (27, -12, 7)) - arc_slot(49, 6, *arc, x=-29, y=-9)
    s = plate(s, 4, holes, edge=0.4)
    out = [(s, "galv")]
    if roller:
        out += [(edged(post(6, 6.5, 4, 7, 9), 0.6), "plastic:0.08,0.08,0.08"), (post(6, 6.5, 4, 3, 10.5), "zinc")]
    return body(*out)


def shaft_support(holes=((-19, 0, 2.8), (19, 0, 2.8)), screw=True, height=27):
    outline = [(-26, 0), (26, 0), (26, 7), (11, 7), (11, height), (-11, height), (-11, 7), (-26, 7)]
    s = profile(outline, 18)
    s = s - b.Pos(0, 0, 17) * b.Rot(90, 0, 0) * b.Cylinder(6, 60) - block(0, 0, 17, 2, 40, 40)
    s = drill(s, holes)
    out = [(s, "alu")]
    if screw:
        head = b.Pos(13, 0, height - 4) * b.Rot(0, 90, 0) * (b.Cylinder(3.4, 4) - b.Pos(0, 0, 2) * b.Cylinder(1.6, 3))
        out.append((head, "blackox"))
    return body(*out)


GASKET_HOLES = [(-34, 9, 2.8), (27, 20, 2.8), (25, -19, 2.8), (-20, -18, 2.8)]


def gasket(holes=GASKET_HOLES, port=True):
    s = spline(
        (-41, 10), (-32, 17), (-8, 16), (18, 25), (32, 23), (31, 6), (28, -8), (31, -22), (20, -25), (0, -20),
        (-18, -25), (-27, -18), (-28, -4),
    )  # fmt: skip
    s = s - disc(8, 1, 13.5)
    if port:
        s = s - (disc(-18, 1, 7) - bar(-25, 1, 6, 20))
    return body((plate(s, 1.6, holes, edge=0.2), "rubber:0.5,0.2,0.13"))


COMB_HOLES = [(-27, 0, 1.9), (-3, 0, 1.9), (24, 0, 2.7)]


def contact_comb(holes=COMB_HOLES, tines=9):
    s = bar(0, 0, 66, 9)
    for k in range(tines):
        length = 10 + 1.9 * k
        s = s + bar(-29.5 + k * 59 / (tines - 1), -4 - length / 2, 3.4, length)
    return body((plate(s + bar(31, 6, 4, 8), 1.3, holes, edge=0.15), "brassplate"))


def elbow(flange=True, barbs=3, colour="0.85,0.84,0.78"):
    z = 6.0

    def leg(length):
        s = b.Pos(0, 0, length / 2) * b.Cylinder(4.2, length)
        for k in range(barbs):
            s = s + b.Pos(0, 0, length - 3 - 5.5 * k) * b.Cone(5.6, 4.2, 5)
        return s - b.Pos(0, 0, length / 2 + 8) * b.Cylinder(2.8, length)

    s = b.Pos(0, 0, z) * (b.Rot(0, 90, 0) * leg(44) + b.Rot(-90, 0, 0) * leg(27) + b.Sphere(5.6))
    if flange:
        s = s + plate(rounded(bar(-5, -5, 24, 22), 3), 3, [(-12, -11, 2)], edge=0.3)
    return body((s, f"plastic:{colour}"))


def bayonet_ring(entry=4.6, holes=((0, 25.5, 2), (0, -25.5, 2)), length=38):
    s = disc(0, 0, 31) - disc(0, 0, 15.5)
    for start in (-20, 160):
        x, y = polar(23, start)
        s = s - arc_slot(23, 4.6, start, start + length) - disc(x, y, entry)
    s = plate(s, 5, holes, edge=0.5)
    return body((s + plate(disc(0, 0, 18) - disc(0, 0, 15.5), 8, edge=0.5), "alu"))


def wing_nut(hole=True, spread=24, size=1.0):
    hub = b.Cone(10, 7.5, 12, align=(b.Align.CENTER, b.Align.CENTER, b.Align.MIN))
    wing = rounded(
        polygon((4, 2), (10, 2), (spread, 15), (spread + 4, 22), (spread - 3, 25), (spread - 11, 19), (4, 11)), 2
    )
    s = hub
    for turn in (0, 180):
        s = s + b.Rot(0, 0, turn) * b.extrude(b.Plane.XZ * wing, 1.8, both=True)
    s = drill(s, [(0, 0, 3.6)]) if hole else s
    return settle(transform(cad(s, "brass"), scale(size, size, size)))


def carabiner(colour="0.75,0.1,0.12", gate=True, nose=13.0):
    r = 3.4
    path = b.Line((-8, -12, r), (22, -12, r)) + b.Spline(
        [(22, -12, r), (35, -1, r), (28, nose - 1, r), (15, nose, r)], tangents=[(1, 0, 0), (-1, -0.15, 0)]
    )
    back = b.Spline([(-8, -12, r), (-33, -9, r), (-34, 0, r), (-19, 5, r)], tangents=[(-1, 0, 0), (1, 0.35, 0)])
    out = [(wire(path, r), f"paint:{colour}"), (wire(back, r), f"paint:{colour}")]
    if gate:
        d = np.array([15.0 + 19, nose - 5])
        out.append((wire(b.Line((-19, 5, r), (-19 + d[0], 5 + d[1], r)), 2.3), "steel"))
        for x, y in ((-19, 5), (15, nose)):
            out.append((post(x, y, 0.4, 3.5, 2 * r - 0.8), "steel"))
    return body(*out)


def scissor_half(pivot=True, ring=9.0):
    blade = polygon((-6, -5), (4, -6), (52, -1.5), (53, 0), (8, 7), (-6, 6))
    shank = polygon((-4, 6), (-4, -4), (-34, 4), (-34, 12))
    finger = b.Pos(-45, 12) * b.Rot(0, 0, -20) * (b.Ellipse(15, ring + 4) - b.Ellipse(10.5, ring - 1))
    hole = b.Pos(-45, 12) * b.Rot(0, 0, -20) * b.Ellipse(10.5, ring - 1)
    s = b.extrude((blade + shank + finger) - hole, 3)
    s = drill(s, [(0, 0, 2.6)]) if pivot else s
    bevel = b.Pos(28, 5.6, 3.4) * b.Rot(0, 0, -8.5) * b.Rot(35, 0, 0) * b.Box(54, 5, 3)
    return body((s - bevel, "steel"))


OVAL_HOLES = [(-27, 0, 3.6), (27, 0, 3.6)]


def oval_flange(holes=OVAL_HOLES, bore=8.0):
    s = plate(link((-27, 0, 8.5), (0, 0, 19), (27, 0, 8.5)), 6, holes, edge=0.6)
    s = s + plate(disc(0, 0, 13.5), 14, edge=0.8)
    return body((drill(s, [(0, 0, bore)]), "bronze"))
