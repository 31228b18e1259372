"""Loose objects that are never taught. No object is in both groups."""

import build123d as b

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
    slot,
    wire,
)
from meshes import rot, transform


def lying(groups):
    """An object drawn along z, rotated to lie along x."""
    return transform(groups, rot("y", 90))


def hexagon(across_flats):
    return b.RegularPolygon(across_flats / 2, 6, major_radius=False)


def nut(across_flats, hole, height, mat):
    return body((edged(b.extrude(hexagon(across_flats) - disc(0, 0, hole), height), 0.5), mat))


def washer(outer, inner, t, mat):
    return body((plate(disc(0, 0, outer) - disc(0, 0, inner), t), mat))


def threaded(r, length, pitch=1.5):
    """A shank with grooves for a thread."""
    s = post(0, 0, 0, r, length)
    for k in range(int((length - 4) / pitch)):
        s = s - (post(0, 0, 1 + k * pitch, r + 1, 0.5 * pitch) - post(0, 0, 0, r * 0.88, length))
    return s


def hex_bolt(across_flats, r, length, mat):
    return lying(body((b.extrude(hexagon(across_flats), r) + b.Pos(0, 0, -length) * threaded(r, length), mat)))


def pan_screw(r, length, mat):
    head = edged(post(0, 0, 0, 2 * r, 1.3 * r), 0.5 * r) - block(0, 0, 0.8 * r, 2.6 * r, 0.6 * r, 9)
    head = head - block(0, 0, 0.8 * r, 0.6 * r, 2.6 * r, 9)
    return lying(body((head + b.Pos(0, 0, -length) * threaded(r, length, 1.0), mat)))


def grub_key(length, width, height, mat):
    return body((plate(slot(0, 0, length, width), height, edge=0.3), mat))


def bearing():
    ring = b.extrude((disc(0, 0, 13) - disc(0, 0, 11)) + (disc(0, 0, 7) - disc(0, 0, 5)), 8)
    shield = b.Pos(0, 0, 0.7) * b.extrude(disc(0, 0, 11) - disc(0, 0, 7), 6.6)
    return body((ring, "steel"), (shield, "plastic:0.1,0.1,0.1"))


def dip_chip(pins=14):
    length = pins / 2 * 2.54
    s = edged(block(0, 0, 3, length, 6.6, 3.4), 0.4) - post(-length / 2, 0, 5.6, 1.1, 3)
    legs = [block((k - (pins / 2 - 1) / 2) * 2.54, y, 0.5, 0.9, 0.4, 4) for k in range(pins // 2) for y in (-3.9, 3.9)]
    return body((s, "plastic:0.12,0.12,0.12"), *[(leg, "tin") for leg in legs])


def electrolytic(r, length, colour):
    s = edged(post(0, 0, 0, r, length), 0.5)
    legs = post(r / 2, 0, -9, 0.35, 9) + post(-r / 2, 0, -9, 0.35, 9)
    return lying(body((s, f"plastic:{colour}"), (post(0, 0, length, r * 0.8, 0.1), "alu"), (legs, "tin")))


def relay():
    return body((edged(block(0, 0, 0, 28, 12, 15, 0.8), 0.6), "plastic:0.85,0.35,0.1"))


def screw_terminal(count):
    s = edged(block(0, 0, 0, 5 * count, 9, 10), 1.0)
    screws = [(post((k - (count - 1) / 2) * 5, 1, 8.5, 1.7, 1.6), "zinc") for k in range(count)]
    return body((s, "plastic:0.1,0.5,0.25"), *screws)


def usb_plug():
    shell = block(8, 0, 0, 16, 12, 4.5) - block(10, 0, 0.5, 16, 11, 3.5)
    return body((shell, "tin"), (block(-10, 0, -1.5, 20, 15, 7.5, 2), "plastic:0.15,0.15,0.16"))


def compression_spring():
    coils = [b.Pos(0, 0, k * 2.6) * b.Rot(6, 0, 0) * b.Torus(4, 0.6) for k in range(9)]
    return lying(body(*[(c, "steel") for c in coils]))


def cotter():
    path = b.Line((0, 0, 1), (26, 0, 1)) + b.ThreePointArc((26, 0, 1), (29, -2.2, 1), (26, -4.4, 1))
    path = path + b.Line((26, -4.4, 1), (8, -2.2, 1))
    return body((wire(path, 0.9), "zinc"))


def paper_clip():
    path = b.Line((10, -3.5, 0.6), (-9, -3.5, 0.6)) + b.ThreePointArc((-9, -3.5, 0.6), (-12.5, 0, 0.6), (-9, 3.5, 0.6))
    path = path + b.Line((-9, 3.5, 0.6), (11, 3.5, 0.6))
    path = path + b.ThreePointArc((11, 3.5, 0.6), (13.7, 0.8, 0.6), (11, -1.9, 0.6))
    return body((wire(path + b.Line((11, -1.9, 0.6), (-5, -1.9, 0.6)), 0.5), "zinc"))


def cable_piece(colour):
    path = b.Spline((-24, 0, 1.6), (-8, 6, 1.6), (6, -5, 1.6), (22, 3, 1.6))
    return body((wire(path, 1.5), f"rubber:{colour}"))


def spacer(outer, inner, length, mat):
    return lying(body((b.Pos(0, 0, length / 2) * (b.Cylinder(outer, length) - b.Cylinder(inner, length)), mat)))


def hex_standoff():
    return lying(body((drill(b.extrude(hexagon(7), 20), [(0, 0, 1.7)]), "brass")))


def pinion():
    return body((plate(gear_outline(14, 1.2) - disc(0, 0, 2.5), 8, edge=0), "plastic:0.9,0.9,0.86"))


def coin_cell():
    return body((edged(post(0, 0, 0, 10, 3.0), 0.5), "zinc"), (post(0, 0, 3.0, 8.4, 0.2), "steel"))


def clip_nut():
    outline = [(-9, 0), (9, 0), (9, 1), (-8, 1), (-8, 5), (7, 5), (7, 6), (-9, 6)]
    return body((drill(profile(outline, 14), [(1, 0, 2.6)]), "blackox"))


def plastic_cap(colour):
    s = edged(post(0, 0, 0, 9, 11), 1.2)
    for x, y, r in ring_of(12, 9.3, 0.7):
        s = s - post(x, y, 2, r, 20)
    return body((s, f"plastic:{colour}"))


def angle_piece():
    return body(
        (drill(profile([(0, 0), (22, 0), (22, 1.6), (1.6, 1.6), (1.6, 14), (0, 14)], 14), [(13, 0, 2.4)]), "galv")
    )


def pencil_stub():
    shaft = b.Pos(0, 0, -34) * b.extrude(hexagon(7), 34)
    tip = b.Cone(3.2, 0.6, 12, align=(b.Align.CENTER, b.Align.CENTER, b.Align.MIN))
    return lying(body((shaft, "paint:0.75,0.6,0.12"), (tip, "plastic:0.78,0.62,0.45")))


def eraser():
    return body((edged(block(0, 0, 0, 30, 16, 9, 1.5), 1.0), "rubber:0.88,0.86,0.85"))


def e_clip():
    ring = disc(0, 0, 8) - disc(0, 0, 5) - bar(0, -8, 6.5, 12)
    teeth = bar(-5, 0, 3, 2.4) + bar(5, 0, 3, 2.4) + bar(0, 5, 2.4, 3)
    return body((plate(ring + teeth, 1, edge=0.1), "blackox"))


def wing_blank():
    return body((plate(link((-9, 0, 4), (0, 0, 6), (9, 0, 4)), 2.5, [(0, 0, 3)]), "copper"))


def triangle_tag():
    return body((plate(polygon((-13, -9), (13, -9), (0, 13)), 0.8, [(0, 6, 1.8)]), "paint:0.8,0.15,0.12"))


def toggle():
    s = block(0, 0, 0, 13, 8, 10) + post(0, 0, 10, 2.9, 7)
    lever = b.Pos(0, 0, 17) * b.Rot(18, 0, 0) * post(0, 0, -1, 1.2, 10)
    return body((s, "plastic:0.55,0.1,0.1"), (lever, "zinc"))


TUNE = dict(
    nut13=lambda: nut(13, 4, 6.5, "zinc"),
    washer12=lambda: washer(12, 5.2, 2, "zinc"),
    bolt8=lambda: hex_bolt(13, 4, 30, "zinc"),
    pan4=lambda: pan_screw(2, 16, "steel"),
    key=lambda: grub_key(28, 7, 6, "steel"),
    dip=dip_chip,
    capacitor=lambda: electrolytic(5, 14, "0.12,0.2,0.45"),
    terminal=lambda: screw_terminal(3),
    spring=compression_spring,
    clip=paper_clip,
    cable=lambda: cable_piece("0.7,0.1,0.1"),
    spacer=lambda: spacer(5, 2.6, 16, "alu"),
    pinion=pinion,
    clip_nut=clip_nut,
    cap=lambda: plastic_cap("0.85,0.2,0.15"),
    eraser=eraser,
    e_clip=e_clip,
)

UNTUNED = dict(
    nut17=lambda: nut(17, 5, 8, "blackox"),
    washer8=lambda: washer(8.5, 3.2, 1.4, "brass"),
    bolt6=lambda: hex_bolt(10, 3, 22, "blackox"),
    pan5=lambda: pan_screw(2.5, 25, "zinc"),
    bearing=bearing,
    capacitor=lambda: electrolytic(4, 11, "0.1,0.1,0.1"),
    relay=relay,
    terminal=lambda: screw_terminal(2),
    usb=usb_plug,
    cotter=cotter,
    cable=lambda: cable_piece("0.1,0.25,0.6"),
    standoff=hex_standoff,
    coin=coin_cell,
    cap=lambda: plastic_cap("0.15,0.35,0.75"),
    angle=angle_piece,
    pencil=pencil_stub,
    wing=wing_blank,
    tag=triangle_tag,
    toggle=toggle,
)
