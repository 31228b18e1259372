"""Drawings of the parts in `parts_tune.py`."""

import math

import build123d as b

import prints
from drawing import (
    bar,
    block,
    body,
    disc,
    drill,
    edged,
    gear_outline,
    link,
    plate,
    polygon,
    post,
    profile,
    ring_of,
    rounded,
    slot,
    wire,
)
from meshes import cad, scale, settle, transform

PLATE_HOLES = [(-31, -15, 2.8), (31, -2, 3.4), (-31, 15, 2.8), (10, 12, 4.8), (-8, -6, 7.5)]


def stamped_plate(holes=PLATE_HOLES, slots=((15, -10, 20, 5, 0),)):
    outline = polygon(
        (-38, -22),
        (18, -22),
        (26, -15),
        (38, -15),
        (38, 8),
        (24, 22),
        (-8, 22),
        (-8, 15),
        (-21, 15),
        (-21, 22),
        (-38, 22),
    )
    return body((plate(rounded(outline, 1.5), 2.5, holes, slots), "blackox"))


Z_HOLES = [(-26, 5, 3.2), (14, -5, 4.2), (-13, -6, 2.2)]


def z_bracket(holes=Z_HOLES, corner=8):
    s = profile([(-38, 0), (0, 0), (0, 14), (24, 14), (24, 16.2), (-2.2, 16.2), (-2.2, 2.2), (-38, 2.2)], 26)
    s = drill(s, holes)
    if corner:
        s = s - b.extrude(polygon((25, 14), (25, 14 - corner), (25 - corner, 14)), 60)
    return body((s - block(-30, -11.5, -1, 12, 7, 30), "galv"))


LEVER_HOLES = [(-36, -7, 4.6), (0, 8, 2.8), (35, -5, 2.4)]


def lever(holes=LEVER_HOLES, slots=((-18, 0.5, 14, 4, 22.6),)):
    s = link((-36, -7, 10), (0, 8, 7.5)) + link((0, 8, 7.5), (35, -5, 6))
    return body((plate(s, 3, holes, slots, edge=0.4), "steel"))


def gear(holes=tuple(ring_of(4, 17.5, 5.5)), size=1.0):
    wheel = plate(gear_outline(28, 2.0) - disc(0, 0, 5), 7, holes, edge=0)
    hub = plate(disc(0, 0, 10) - disc(0, 0, 5), 13, edge=0.6)
    return settle(transform(cad(wheel + hub, "brass"), scale(size, size, size)))


def cam_disc(holes=((-12, 9, 2.8),), rise=15.0):
    steps = [k / 40 for k in range(41)]
    radius = [13 + rise * t for t in steps]
    points = [(r * math.cos(2 * math.pi * t), r * math.sin(2 * math.pi * t)) for t, r in zip(steps, radius)]
    face = b.make_face(b.Spline(*points) + b.Line(points[-1], points[0]))
    face = face - disc(0, 0, 5.5) - bar(0, 5.5, 3, 4)
    return body((plate(face, 6, holes, edge=0.4), "steel"))


SADDLE_HOLES = [(-22, 0, 3.2)]


def pipe_saddle(holes=SADDLE_HOLES, slots=((22, 0, 10, 5, 90),), r=12.0, t=1.8, width=18):
    flange = plate(rounded(bar(0, 0, 62, width), 4), t, edge=0.2) - block(0, 0, -1, 2 * r - 2, width + 2, 20)
    arch = b.extrude(b.Plane.XZ * (b.Circle(r) - b.Circle(r - t)), width / 2, both=True)
    arch = arch - block(0, 0, -40, 80, 80, 40)
    s = drill(flange + arch, holes)
    for sl in slots:
        s = s - b.extrude(slot(*sl), 30, both=True)
    return body((s, "zinc"))


def cable_lug(hole=(20, 0, 5.2), mat="tin"):
    tongue = rounded(bar(9, 0, 26, 18), 1) + disc(22, 0, 9)
    tongue = plate(tongue, 2.8, edge=0.4, holes=[hole] if hole else [])
    barrel = b.Pos(-20, 0, 6) * b.Rot(0, 90, 0) * (b.Cylinder(6, 24) - b.Cylinder(4.2, 60))
    neck = b.loft(
        [
            b.Plane(origin=(-8.5, 0, 6), z_dir=(1, 0, 0)) * b.Circle(6),
            b.Plane(origin=(1, 0, 1.4), z_dir=(1, 0, 0)) * b.RectangleRounded(2.8, 17.6, 1.3),
        ]
    )
    neck = neck if abs(neck.bounding_box().size.Y - 17.6) < 1 else neck.rotate(b.Axis.X, 90)
    return body((barrel, mat), (neck, mat), (tongue, mat))


HEATSINK_HOLES = [(24, 15, 2.4), (-24, -15, 2.4)]


def heatsink(holes=HEATSINK_HOLES, fins=9):
    s = block(0, 0, 0, 62, 44, 4, 0.8)
    pitch = 42 / (fins - 1)
    for k in range(fins):
        s = s + block(0, -21 + k * pitch, 4, 62, 1.7, 15)
    s = s - block(0, 0, 10, 7, 50, 30)
    for x, y, _ in HEATSINK_HOLES:
        s = s - post(x, y, 4, 9, 30)
    return body((drill(s, holes), "anodblack"))


BOARD_HOLES = [(-31, 17, 1.7), (31, 17, 1.7), (31, -17, 1.7)]


def circuit_board(name="t_board", seed=41, holes=BOARD_HOLES, mark=None, connector=True, label="PX-40"):
    w, h, t = 70, 42, 1.6
    top = f"print:{name}"
    prints.board(name, seed, w, h, label=(-16, -17, label, 3.6), mark=mark, drills=holes)
    blank = plate(rounded(bar(0, 0, w, h), 2), t, holes, edge=0)
    groups = cad(blank, lambda f: top if f.center().Z > t - 0.01 else "board:0.15,0.4,0.25")
    groups = prints.on_top(groups, name, w, h)
    black, tin = "plastic:0.08,0.08,0.09", "tin"
    chip = block(-4, 3, t, 13, 13, 1.5, 0.3)
    legs = None
    for k in range(8):
        d = -5.25 + 1.5 * k
        for leg in (block(-4 + d, 3, t, 0.6, 17, 0.6), block(-4, 3 + d, t, 17, 0.6, 0.6)):
            legs = leg if legs is None else legs + leg
    groups += cad(legs, tin) + cad(chip, black)
    for x, y, r, height in ((16, 10, 4, 9), (25, 8, 3.2, 7)):
        groups += cad(edged(post(x, y, t, r, height), 0.4), "plastic:0.15,0.2,0.45") + cad(
            post(x, y, t + height, r * 0.8, 0.05), "alu"
        )
    for x, y, turn in ((-22, 12, 0), (-22, 8, 0), (-16, -8, 90), (-11, -8, 90), (8, -12, 0)):
        chip = b.Rot(0, 0, turn) * b.Pos(0, 0, 0.5) * b.Box(2.0, 1.8, 1.0)
        ends = b.Rot(0, 0, turn) * b.Pos(0, 0, 0.5) * b.Box(3.2, 1.7, 0.9)
        groups += cad(b.Pos(x, y, t) * ends, tin) + cad(b.Pos(x, y, t) * chip, "plastic:0.5,0.4,0.3")
    groups += cad(b.Pos(-31, 2, t + 3) * b.Box(9, 12, 6), "tin")  # USB-like shell
    if connector:
        shell = block(20, -14, t, 22, 6.5, 7) - block(20, -14, t + 1, 20, 4.5, 9)
        groups += cad(shell, "plastic:0.9,0.88,0.8")
        for k in range(8):
            groups += cad(block(12.25 + k * 2.2, -14, t, 0.64, 0.64, 6), "brass")
    return settle(groups)


def knob(mark="line", colour="0.92,0.92,0.9", size=1.0):
    s = post(0, 0, 3, 15.5, 14)
    for x, y, r in ring_of(16, 16.6, 2.0):
        s = s - post(x, y, 3, r, 20)
    s = edged(post(0, 0, 0, 19, 3), 0.8) + s
    s = s - post(0, 0, 15.6, 12, 5)
    groups = cad(s, "plastic:0.1,0.1,0.11")
    if mark == "line":
        groups += cad(block(7.2, 0, 15.6, 8.8, 1.9, 0.25), f"plastic:{colour}")
        groups += cad(block(17.2, 0, 2.4, 3.4, 1.9, 0.7), f"plastic:{colour}")
    elif mark == "dot":
        groups += cad(post(8.5, 0, 15.6, 2.2, 0.25), f"plastic:{colour}")
    return settle(transform(groups, scale(size, size, size)))


def hook(reach=12.0, tip=10.0):
    r = 2.6
    path = (
        b.Line((-26, 0, r), (12, 0, r))
        + b.ThreePointArc((12, 0, r), (12 + reach, -reach, r), (12, -2 * reach, r))
        + b.Line((12, -2 * reach, r), (12 - tip, -2 * reach, r))
    )
    eye = b.Pos(-33.5, 0, r) * b.Torus(7.5, r)
    ball = b.Pos(12 - tip, -2 * reach, r) * b.Sphere(r)
    return body((wire(path, r), "zinc"), (eye, "zinc"), (ball, "zinc"))


def spanner(ring_hole=True, jaw=13.0, turn=18.0):
    head = disc(-44, 0, 13.5) + bar(0, 0, 90, 10)
    mouth = b.Pos(-44, 0) * b.Rot(0, 0, 180 - turn) * (b.Pos(10, 0) * b.Rectangle(24, jaw))
    sketch = head + disc(44, 0, 9.5) - mouth
    s = plate(sketch, 5, [(44, 0, 5.6)] if ring_hole else [], edge=0.5)
    recess = slot(2, 0, 58, 5)
    return body((s - b.Pos(0, 0, 4.3) * b.extrude(recess, 2), "steel"))


BLOCK_HOLES = [(-27, -16, 2.3), (27, 16, 2.3), (-27, 16, 2.3), (6, -14.5, 2.3)]


def pocket_block(holes=BLOCK_HOLES, pocket=(-9, 4)):
    s = block(0, 0, 0, 62, 40, 13, 1.5)
    s = s - b.extrude(polygon((33, -8), (33, -22), (19, -22)), 40, both=True)
    s = edged(s, 0.5)
    s = s - block(*pocket, 5, 26, 17, 20, 4)
    s = s - post(18, -1, 7, 8, 20) - post(18, -1, -5, 3, 40)
    s = s - block(12, 18, 9, 22, 5, 10)
    return body((drill(s, holes), "alu"))


RETAINER_HOLES = [(30, 9, 3.0), (-30, -9, 3.0)]


def retainer(holes=RETAINER_HOLES):
    arm = link((4, 7, 8), (30, 9, 6))
    sketch = disc(0, 0, 15) + arm + b.Rot(0, 0, 180) * arm
    s = plate(sketch, 3, holes, edge=0.4)
    s = s + plate(disc(0, 0, 11.5), 8, edge=0.6)
    return body((s - post(0, 0, -5, 7, 30), "plastic:0.93,0.72,0.1"))


def cast_arm(lug=True, lug_hole=True):
    s = plate(link((-28, 0, 11), (34, 9, 6)), 6, edge=0.6)
    if lug:
        s = s + plate(link((0, 0, 5), (4, -16, 6)), 6, edge=0.6)
    rib = b.Pos(0, 0, 6) * b.extrude(bar(3, 4.5, 60, 3.5, 8.3), 6)
    s = s + rib + edged(post(-28, 0, 0, 14, 18), 1.0) + edged(post(34, 9, 0, 8.5, 13), 0.8)
    s = drill(s, [(-28, 0, 7), (34, 9, 4)] + ([(4, -16, 3)] if lug and lug_hole else []))
    return body((s - block(-28, 8.5, -5, 4, 5, 60), "cast"))


def connector_housing(pins=6, ribs=(-13, 9), latch=True):
    length = 8 * pins
    s = block(0, 0, 0, length, 17, 12, 0.8)
    for k in range(pins):
        for y in (-3.6, 3.6):
            s = s - block((k - (pins - 1) / 2) * 7.2, y, 3, 4.2, 4.2, 20)
    for k, x in enumerate(ribs):
        s = s + block(x * length / 48, 9, 0, 3 + 3 * k, 2.4, 12)
    if latch:
        s = s + block(-4, -10.5, 4, 12, 5, 3) + block(-4, -13, 4, 12, 2, 7)
    return body((s, "plastic:0.16,0.36,0.66"))
