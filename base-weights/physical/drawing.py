"""Tools to draw parts with build123d. Lengths in mm, angles in degrees; a part is drawn as it rests on a table, z up.

A hole is (x, y, radius); a slot is (x, y, length, width, angle).
"""

import math

import build123d as b

from meshes import cad, lengthen, mirror, settle


def disc(x, y, r):
    return b.Pos(x, y) * b.Circle(r)


def bar(x, y, length, width, turn=0.0):
    return b.Pos(x, y) * b.Rot(0, 0, turn) * b.Rectangle(length, width)


def slot(x, y, length, width, turn=0.0):
    return b.Pos(x, y) * b.Rot(0, 0, turn) * b.SlotOverall(length, width)


def polygon(*points):
    return b.make_face(b.Polyline(*points, close=True))


def spline(*points):
    """The face inside a closed smooth curve."""
    return b.make_face(b.Spline(*points, periodic=True))


def link(*circles):
    """The convex hull of circles (x, y, r)."""
    edges = [e for c in circles for e in disc(*c).edges()]
    return b.make_hull(edges)


def rounded(sketch, r):
    """Rounds the corners with the largest of a few radii that fits."""
    for radius in (r, r * 0.6, r * 0.3):
        try:
            return b.fillet(sketch.vertices(), radius)
        except Exception:  # OpenCASCADE raises several types of exception if a radius does not fit
            continue
    return sketch


def edged(solid, d):
    """Chamfers the upper edges, if possible."""
    try:
        return b.chamfer(solid.edges().group_by(b.Axis.Z)[-1], d)
    except Exception:  # as above
        return solid


def plate(sketch, t, holes=(), slots=(), edge=0.25, z=0.0):
    """Extrudes a sketch with its holes cut out."""
    for h in holes:
        sketch = sketch - disc(*h)
    for s in slots:
        sketch = sketch - slot(*s)
    solid = b.extrude(sketch, t)
    return b.Pos(0, 0, z) * (edged(solid, edge) if edge else solid)


def block(x, y, z, dx, dy, dz, r=0.0):
    """A box with the centre of its lower face at (x, y, z) and rounded vertical edges."""
    solid = b.Pos(x, y, z + dz / 2) * b.Box(dx, dy, dz)
    return b.fillet(solid.edges().filter_by(b.Axis.Z), r) if r else solid


def post(x, y, z, r, h):
    return b.Pos(x, y, z + h / 2) * b.Cylinder(r, h)


def drill(solid, holes):
    for x, y, r in holes:
        solid = solid - post(x, y, -50, r, 200)
    return solid


def profile(points, width, y=0.0):
    """A polygon in x, z extruded along y; `y` is the centre of its width."""
    face = b.make_face(b.Plane.XZ * b.Polyline(*points, close=True))
    return b.Pos(0, y, 0) * b.extrude(face, width / 2, dir=(0, 1, 0), both=True)


def wire(path, r):
    """Round bar along a path of build123d edges."""
    start = path @ 0
    section = b.Plane(origin=start, z_dir=path % 0) * b.Circle(r)
    return b.sweep(section, path, transition=b.Transition.ROUND)


def gear_outline(teeth, module, root=1.25, tip=1.0):
    """A gear with straight-sided teeth, close to involute ones at this size."""
    pitch = teeth * module / 2
    points = []
    for k in range(teeth):
        for share, r in ((-0.36, -root), (-0.25, 0), (-0.12, tip), (0.12, tip), (0.25, 0), (0.36, -root)):
            a = 2 * math.pi * (k + share) / teeth
            points.append(((pitch + r * module) * math.cos(a), (pitch + r * module) * math.sin(a)))
    return polygon(*points)


def ring_of(count, radius, r, start=0.0):
    """Holes on a circle."""
    angles = [math.radians(start + 360 * k / count) for k in range(count)]
    return [(radius * math.cos(a), radius * math.sin(a), r) for a in angles]


def moved(holes, index, dx, dy):
    """The holes with one hole moved."""
    return [(h[0] + dx, h[1] + dy, *h[2:]) if i == index else h for i, h in enumerate(holes)]


def without(holes, index):
    return [h for i, h in enumerate(holes) if i != index]


def body(*solids):
    """Joins (solid, material) pairs to one body, with the centre of its box at x = y = 0 and its bottom at z = 0."""
    return settle([g for solid, mat in solids for g in cad(solid, mat)])


def part(draw, cam, chiral, looks, longer=None, sym=1, grasp=None, table=None):
    """A part's entry in a list.

    `draw` makes the part; `cam` is (camera height in mm, horizontal field of view in degrees); `looks` are look-alikes
    (difference, draw); `longer` is the region (x0, x1) that is stretched to make the part 20 % longer; `sym` is the
    number of angles at which the part looks the same; `grasp` is (x0, y0, x1, y1).
    """
    looks = list(looks)
    if chiral:
        looks.insert(0, ("mirror image", lambda: mirror(draw())))
    if longer:
        looks.append(("20 % longer", lambda: lengthen(draw(), *longer)))
    return dict(make=draw, look=looks, cam=cam, chiral=chiral, sym=sym, grasp=grasp, table=table)
