"""Parts of revolution, the group `roll`: they rest on the table at any angle about their axis. Constants and methods of
the program may be chosen by their results.

A part consists of sections along x, each with a radius as a function of the position along the axis and the
angle about it, which gives threads their helix and heads their hexagon. The axis is y = z = 0.
"""

import numpy as np

from meshes import face_mesh, join

ANGLES = 144
STEP_MM = 0.25


def cone(first, last):
    return lambda x, angle, share: first + (last - first) * share


def cylinder(radius):
    return cone(radius, radius)


def hexagon(across_flats):
    def radius(x, angle, share):
        return across_flats / 2 / np.cos((angle + np.pi / 6) % (np.pi / 3) - np.pi / 6)

    return radius


def thread(radius, pitch, depth, starts=1, left=False, flat=0.1):
    """A thread with straight flanks; `flat` is the fraction of the pitch for the crest, and for the root."""

    def at(x, angle, share):
        phase = (x / pitch - starts * (-1 if left else 1) * angle / (2 * np.pi)) % 1.0
        ramp = np.clip((np.abs(2 * phase - 1) - flat) / (1 - 2 * flat), 0, 1)
        return radius - depth * ramp

    return at


def knurl(radius, count, depth):
    return lambda x, angle, share: radius - depth * np.abs((angle * count / (2 * np.pi)) % 1.0 - 0.5)


def rings(radius, pitch, depth):
    """Ribs without a helix."""
    return lambda x, angle, share: radius - depth * (0.5 + 0.5 * np.cos(2 * np.pi * x / pitch))


def lathe(*sections):
    """Sections (length, radius function, material) in sequence along x, closed by rings and discs."""
    groups, x = {}, 0.0
    angle = np.linspace(0, 2 * np.pi, ANGLES, endpoint=False)
    ends = np.zeros(ANGLES)
    last_mat = None

    def surface(x0, r0, x1, r1):
        def ring(at, r):
            return np.column_stack([np.full(ANGLES, at), r * np.cos(angle), r * np.sin(angle)])

        return np.vstack([ring(x0, r0), ring(x1, r1)])

    def quads(rows):
        k = np.arange(ANGLES)
        n = (k + 1) % ANGLES
        faces = []
        for row in range(rows - 1):
            a, b = row * ANGLES, (row + 1) * ANGLES
            faces += [np.column_stack([a + k, a + n, b + k]), np.column_stack([a + n, b + n, b + k])]
        return np.vstack(faces)[:, ::-1]

    for length, radius, mat in sections:
        count = max(2, int(np.ceil(length / STEP_MM)) + 1)
        at = np.linspace(x, x + length, count)
        radii = [radius(one, angle, (one - x) / length) * np.ones(ANGLES) for one in at]
        groups.setdefault(mat, []).append(face_mesh(surface(x, ends, x, radii[0]), quads(2)))
        v = np.vstack([np.column_stack([np.full(ANGLES, a), r * np.cos(angle), r * np.sin(angle)]) for a, r in zip(at, radii)])
        groups[mat].append(face_mesh(v, quads(count)))
        x, ends, last_mat = x + length, radii[-1], mat
    groups[last_mat].append(face_mesh(surface(x, ends, x, np.zeros(ANGLES)), quads(2)))
    out = []
    for mat, faces in groups.items():
        group = join(faces, mat)
        out.append(dict(group, v=group["v"] - [x / 2, 0, 0]))
    return out


def hex_bolt(shank=34, head=16.0, mat="zinc"):
    return lathe(
        (0.8, cone(head / 2 - 1, head / 2), mat), (5.5, hexagon(head), mat), (shank - 22, cylinder(4.9), mat),
        (21, thread(5, 1.5, 0.9), mat), (1, cone(4, 3.4), mat),
    )  # fmt: skip


def fitting(barbs=3, hexagonal=17.0):
    barb = [section for _ in range(barbs) for section in ((5, cone(4.4, 6), "brass"), (0.6, cylinder(5), "brass"))]
    return lathe((1, cone(3, 4.2), "brass"), *barb, (3, cylinder(5), "brass"), (8, hexagon(hexagonal), "brass"),
                 (12, thread(6.6, 1.4, 0.85), "brass"), (1, cone(5.6, 5), "brass"))  # fmt: skip


def lead_screw(length=40, starts=2, left=False):
    return lathe((9, cylinder(4), "steel"), (4, cylinder(7.5), "steel"), (length, thread(7, 4 * starts, 1.6, starts, left, 0.15), "steel"),
                 (14, cylinder(4.2), "steel"), (1, cone(4.2, 3.4), "steel"))  # fmt: skip


def auger(length=30, depth=2.6):
    return lathe((11, cylinder(5.5), "cast"), (length, thread(9, 7, depth, 1, False, 0.18), "cast"), (16, cylinder(5), "cast"), (1, cone(5, 4), "cast"))


def pin(groove=14, length=40):
    return lathe((1, cone(3.6, 4.4), "blackox"), (groove, cylinder(4.4), "blackox"), (2.2, cylinder(3.4), "blackox"),
                 (length - groove - 12, cylinder(4.4), "blackox"), (9, cylinder(6.2), "blackox"), (0.8, cone(6.2, 5.4), "blackox"))  # fmt: skip


def plug(ribs=14, hexagonal=18.0):
    white = "plastic:0.75,0.75,0.72"
    return lathe((6, cylinder(2.6), "zinc"), (ribs, rings(5.2, 3.2, 0.9), white), (7, cylinder(5.2), white), (8, hexagon(hexagonal), "zinc"),
                 (3, cylinder(8), "zinc"), (13, thread(6, 1.25, 0.75), "zinc"), (3, cylinder(1.4), "zinc"))  # fmt: skip


def thumb_screw(head=10, shank=26):
    return lathe((0.8, cone(8.2, 9), "anodblue"), (head, knurl(9.2, 36, 1.0), "anodblue"), (0.8, cone(9, 8.2), "anodblue"),
                 (3, cylinder(6), "anodblue"), (shank, thread(4, 1.25, 0.75), "steel"), (0.8, cone(3.3, 2.8), "steel"))  # fmt: skip


def rolling(draw, cam, looks):
    return dict(make=draw, look=looks, cam=cam, chiral=False, sym=1, roll=True)


PARTS = dict(
    r_bolt=rolling(hex_bolt, (360, 48), [("longer", lambda: hex_bolt(43)), ("shorter", lambda: hex_bolt(26)), ("smaller head", lambda: hex_bolt(34, 12.0))]),
    r_fitting=rolling(fitting, (380, 50), [("one barb more", lambda: fitting(4)), ("two barbs", lambda: fitting(2)), ("larger hexagon", lambda: fitting(3, 22.0))]),
    r_leadscrew=rolling(
        lead_screw, (410, 52), [("longer", lambda: lead_screw(54)), ("one start", lambda: lead_screw(40, 1)), ("left hand", lambda: lead_screw(40, 2, True))]
    ),
    r_auger=rolling(auger, (390, 50), [("longer", lambda: auger(42)), ("shorter", lambda: auger(21)), ("flat thread", lambda: auger(30, 1.0))]),
    r_pin=rolling(pin, (340, 46), [("groove moved", lambda: pin(20)), ("longer", lambda: pin(14, 50)), ("groove at the end", lambda: pin(5))]),
    r_plug=rolling(plug, (390, 50), [("shorter ribs", lambda: plug(8)), ("larger hexagon", lambda: plug(14, 23.0)), ("longer ribs", lambda: plug(20))]),
    r_thumb=rolling(thumb_screw, (350, 55), [("longer", lambda: thumb_screw(10, 36)), ("flat head", lambda: thumb_screw(5)), ("shorter", lambda: thumb_screw(10, 18))]),
)
