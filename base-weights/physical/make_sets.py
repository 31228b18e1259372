"""Renders sets of pictures of parts, with exact ground truth. Usage:

    make_sets.py GROUP OUT_DIR [--sets a,b] [--only demo,plain_0,...] [--spp 10] [--resume]

GROUP is `tune`, `roll` or `untuned`. The list of parts and the group's seed determine everything.
"""

import argparse
import json
import math
import os
import time
from dataclasses import dataclass

import cv2
import numpy as np
from shapely.geometry import Polygon

import camera  # noqa: F401 (sets Mitsuba's variant; must precede everything that uses Mitsuba)
import clutter
import materials
import parts_roll
import parts_tune
import parts_untuned
import photo
import surfaces
from bodies import Body, footprint, grasp_ends, lift, lying, rest
from camera import HEIGHT, WIDTH, Camera, cast, hidden
from scatter import scatter
from scene import SLOTS, Scene, make_light, stream

MAX_OUTLINE_POINTS = 60
MAX_COVERED = 0.25  # maximum fraction of a part that clutter covers
OPTIONAL_HIDDEN = 0.4  # an instance is optional if more than this fraction of it is invisible


@dataclass
class Group:
    """`seed` names the group's random numbers, `pictures` the number of pictures per kind."""

    name: str
    parts: dict
    clutter: dict
    seed: str
    pictures: dict


GROUPS = dict(
    tune=Group(
        "tune",
        parts_tune.PARTS,
        clutter.TUNE,
        "tune 2025-1",
        dict(plain=2, view=1, light=3, clutter=2, several=1, neg_other=1, neg_look=4),
    ),
    roll=Group(
        "roll",
        parts_roll.PARTS,
        clutter.TUNE,
        "roll 2026-1",
        dict(plain=4, view=3, light=3, clutter=3, several=3, neg_other=1, neg_look=4),
    ),
    untuned=Group(
        "untuned",
        parts_untuned.PARTS,
        clutter.UNTUNED,
        "untuned 2025-7",
        dict(plain=4, view=4, light=4, clutter=4, several=4, neg_look=10),
    ),
)


def choose_table(rng, body):
    """A plain table that contrasts with the part."""
    area = {}
    for g in body.groups:
        a, b, c = (g["v"][g["f"][:, k]] for k in range(3))
        up = np.maximum(0, np.cross(b - a, c - a)[:, 2]).sum()
        area[g["mat"]] = area.get(g["mat"], 0) + up
    light = np.average([materials.lightness(m) for m in area], weights=list(area.values()))
    if light < 0.42:
        tables = ["white", "grey", "woodlight", "cardboard", "concrete"]
    elif light > 0.7:
        tables = ["grey", "bluemat", "wooddark", "greenmat", "cardboard"]
    else:
        tables = ["white", "bluemat", "woodlight", "grey", "black", "felt"]
    return tables[rng.integers(len(tables))]


def outline(mask):
    """The mask's largest outer contour, simplified to a valid polygon of at most MAX_OUTLINE_POINTS points."""
    contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    contour = max(contours, key=cv2.contourArea)
    tolerance = 0.4
    while True:
        poly = cv2.approxPolyDP(contour, tolerance, True)[:, 0].astype(float) + 0.5
        if len(poly) <= MAX_OUTLINE_POINTS and Polygon(poly).is_valid:
            return poly
        if len(poly) < 24:
            break  # the simplified outline crosses itself: simplify with preserved topology
        tolerance *= 1.15
    g = Polygon(contour[:, 0].astype(float) + 0.5).buffer(0)
    g = max(g.geoms, key=lambda q: q.area) if hasattr(g, "geoms") else g
    tolerance = 0.4
    while len((q := g.simplify(tolerance, preserve_topology=True)).exterior.coords) > MAX_OUTLINE_POINTS + 1:
        tolerance *= 1.1
    return np.array(q.exterior.coords)[:-1]


def write_json(path, value):
    with open(path, "w") as f:
        json.dump(value, f, indent=1)


class Setting:
    """The settings that depend on a picture's kind: camera, light, table, number of instances."""

    def __init__(self, cam, ground):
        self.cam, self.ground = cam, ground
        self.style = "plain"
        self.exposure, self.noise_gain = None, 1.0
        self.instances = 1
        self.sheet = False


class SetMaker:
    """Renders one part's set. `index` is the part's number in its group; it shifts the variants of the kinds."""

    scene_type = Scene

    def __init__(self, group, name, root, spp, only, resume):
        self.group, self.name, self.spp, self.only, self.resume = group, name, spp, only, resume
        self.spec = group.parts[name]
        self.index = list(group.parts).index(name)
        self.dir = os.path.join(root, name)
        os.makedirs(self.dir, exist_ok=True)
        self.body = Body.get(f"{name}_0", self.spec["make"])
        self.looks = [(what, Body.get(f"{name}_{k + 1}", make)) for k, (what, make) in enumerate(self.spec["look"])]
        self.others = [Body.get(f"{o}_0", p["make"]) for o, p in group.parts.items() if o != name]
        self.pool = [Body.get(f"c_{group.name}_{c}", make) for c, make in group.clutter.items()]
        self.marks, self.lift = grasp_ends(self.body, self.spec), lift(self.body, self.spec)
        self.bsdfs = {}
        self.truth = []
        rng = stream(group.seed, name, "camera")
        self.height, self.fov = self.spec["cam"]
        self.k1 = float(rng.uniform(-0.06, 0.015) if self.fov > 52 else rng.uniform(-0.03, 0.01))
        self.faults = photo.Faults.draw(rng)
        self.ground = self.spec.get("table") or choose_table(rng, self.body)
        self.diag_px = self.demo_scale = None

    def material(self, name):
        if name not in self.bsdfs:
            self.bsdfs[name] = materials.material(name, stream(self.group.seed, self.name, name))
        return self.bsdfs[name]

    def wanted(self, tag):
        return self.only is None or tag in self.only

    def camera(self, rng, tilt=(0, 3), dist=(0.96, 1.05), off=15):
        return Camera(
            self.height,
            self.fov,
            self.k1,
            rng.uniform(*tilt),
            rng.uniform(0, 360),
            rng.uniform(*dist),
            rng.uniform(-off, off, 2),
            rng.uniform(-180, 180),
        )

    def place(self, rng, cam, body, taken=(), where=None, touch=0.0):
        """A pose inside the picture that does not overlap the footprints `taken`; (None, None) if there is none.

        With the probability `touch` the body may almost touch another one.
        """
        x0, y0, x1, y1 = cam.table(26).bounds
        for attempt in range(400):
            free = where is None or attempt >= 40
            x, y = (rng.uniform(x0, x1), rng.uniform(y0, y1)) if free else where
            m = self.rest(rng, body, rng.uniform(0, 360), x, y)
            p = cam.project(body.hull.vertices @ m[:3, :3].T + m[:3, 3])
            if p.min() < 6 or p[:, 0].max() > WIDTH - 6 or p[:, 1].max() > HEIGHT - 6:
                continue
            foot = footprint(body, m)
            gap = 0.3 if attempt > 200 or rng.random() < touch else 12
            if all(foot.distance(other) > gap for other in taken):
                return m, foot
        return None, None

    def rest(self, rng, body, angle, x, y):
        return lying(body, angle, rng.uniform(0, 360), x, y) if self.spec.get("roll") else rest(angle, x, y)

    def ends(self, m):
        """The grasp line's ends in the world."""
        return self.marks @ m[:3, :3].T + m[:3, 3] + [0, 0, self.lift]

    def render(self, rng, setting, items):
        light = make_light(rng, setting.style)
        table = surfaces.table(rng, setting.ground)
        if setting.style == "glare":
            table.rough = rng.uniform(0.12, 0.25)
        scene = self.scene_type()
        scene.sensor(setting.cam, self.spp)
        scene.light(light)
        scene.table(rng, table)
        scene.sheet(rng, items[0][1][:2, 3] if items else np.zeros(2), setting.sheet)
        scene.phone(setting.cam, self.fov > 52 or rng.random() < 0.6)
        scene.bodies(items, self.material)
        picture = scene.render(self.spp, int(rng.integers(1 << 30)))
        return photo.develop(
            rng,
            setting.cam,
            picture,
            self.faults,
            setting.ground,
            cast(setting.cam, items, 1) >= 0,
            setting.style == "colour",
            setting.exposure,
            setting.noise_gain,
        )

    def instance(self, cam, m, hid=(0.0, 0.0, 0.0)):
        """The ground truth of one instance: its grasp line's ends through the true camera."""
        ends = self.ends(m)
        p = cam.project(ends)
        scale = cam.f / cam.depth(ends.mean(0)) / self.demo_scale
        d = p[1] - p[0]
        return dict(
            points_px=[[round(float(v), 3) for v in q] for q in p],
            centre_px=[round(float(v), 3) for v in p.mean(0)],
            angle_deg=round(math.degrees(math.atan2(d[1], d[0])), 4),
            scale=round(float(scale), 5),
            diag_px=round(float(self.diag_px * scale), 3),
            symmetry_deg=360.0 / self.spec.get("sym", 1),
            optional=bool(hid[2] > OPTIONAL_HIDDEN),
            covered=round(hid[0], 3),
            outside=round(hid[1], 3),
            how="rendered: the body's marks through the true camera",
        )

    def demo(self):
        rng = stream(self.group.seed, self.name, "demo")
        cam = self.camera(rng, tilt=(0, 2.5), dist=(1.0, 1.0))
        m = self.rest(rng, self.body, rng.uniform(0, 360), *(cam.target[:2] + rng.uniform(-0.08, 0.08, 2) * self.height))
        self.demo_scale = cam.f / cam.depth(self.ends(m).mean(0))
        mask = (cast(cam, [(self.body, m)], 1) == 0).astype(np.uint8)
        ys, xs = np.nonzero(mask)
        lo, hi = (float(xs.min()), float(ys.min())), (float(xs.max() + 1), float(ys.max() + 1))
        self.diag_px = math.hypot(hi[0] - lo[0], hi[1] - lo[1])
        ends = self.instance(cam, m)["points_px"]

        def shape(label, kind, points):
            points = [[round(float(a), 2), round(float(b), 2)] for a, b in points]
            return dict(label=label, shape_type=kind, points=points, group_id=1, flags={})

        marks = dict(
            version="5.5.0",
            flags={},
            imagePath="demo.jpg",
            imageData=None,
            imageHeight=HEIGHT,
            imageWidth=WIDTH,
            shapes=[
                shape(self.name, "rectangle", [lo, hi]),
                shape("grasp_start", "point", [ends[0]]),
                shape("grasp_end", "point", [ends[1]]),
                shape(self.name, "polygon", outline(mask)),
            ],
        )
        about = dict(
            part=self.name,
            symmetry=self.spec.get("sym", 1),
            rolls=bool(self.spec.get("roll")),
            chiral=self.spec["chiral"],
            height_mm=round(float(self.body.size[2]), 1),
            size_mm=[round(float(v), 1) for v in self.body.size],
            camera_mm=self.height,
            fov_deg=self.fov,
            k1=round(self.k1, 4),
            diag_px=round(self.diag_px, 1),
            table=self.ground,
        )
        write_json(os.path.join(self.dir, "demo.json"), marks)
        write_json(os.path.join(self.dir, "set.json"), about)
        if self.due("demo", "demo.jpg"):
            setting = Setting(cam, self.ground)
            setting.style = "plain" if rng.random() < 0.6 else "soft"
            self.save("demo.jpg", self.render(rng, setting, [(self.body, m)]))

    def due(self, tag, file):
        done = self.resume and os.path.exists(os.path.join(self.dir, file))
        return self.wanted(tag) and not done

    def save(self, file, picture):
        photo.save(os.path.join(self.dir, file), picture, self.faults)

    def setting(self, rng, kind, variant):
        """`variant` is 0 to 3."""
        s = Setting(self.camera(rng), self.ground)
        plain, busy = surfaces.PLAIN, surfaces.BUSY
        if kind == "plain":
            if variant == 3:
                s.ground = plain[rng.integers(len(plain))]
            s.instances = 2 if variant == 2 else 1
            s.style = ["soft", "plain", "plain", "plain"][variant]
            s.sheet = rng.random() < 0.25
        elif kind == "view":
            dist = [0.82, 1.2, rng.uniform(0.8, 1.25), rng.uniform(0.8, 1.25)][variant] * rng.uniform(0.98, 1.02)
            s.cam = self.camera(rng, tilt=(5, 20), dist=(dist, dist), off=20)
            s.style = ["plain", "soft"][rng.integers(2)]
        elif kind == "light":
            s.style = ["sun", "glare", "dark", "colour"][variant] if rng.random() < 0.7 else "lamp"
            s.ground = (busy + plain)[rng.integers(len(busy) + 6)]
            if s.style == "dark":
                s.exposure, s.noise_gain = rng.uniform(0.025, 0.05), 3.0
            if s.style in ("sun", "lamp") and rng.random() < 0.3:
                s.exposure = rng.uniform(0.5, 0.6)
        elif kind == "clutter":
            s.instances = 2 if variant == 3 else 1
            if variant % 2:
                tables = plain + ["plywood", "cutting", "fabric"]
                s.ground = tables[rng.integers(len(tables))]
            s.style = ["plain", "soft", "lamp", "plain"][variant]
        elif kind == "several":
            s.instances = 3 + variant % 2
            s.style = ["plain", "soft", "plain", "sun"][variant]
        else:
            s.instances = 0
            if kind == "neg_other" and variant % 2 == 0:
                s.ground = plain[rng.integers(len(plain))]
            s.style = ["plain", "soft", "plain", "lamp" if kind == "neg_other" else "plain"][variant]
        return s

    def view_place(self, rng, cam):
        """A place away from the picture's middle."""
        a = rng.uniform(0, 2 * np.pi)
        r = math.sqrt(cam.table(40).area) * rng.uniform(0.22, 0.34)
        return cam.target[0] + r * math.cos(a), cam.target[1] + 0.8 * r * math.sin(a)

    def look_alike(self, k):
        """A look-alike; every second one is the mirror image if the part is chiral."""
        mirrored = [x for x in self.looks if x[0] == "mirror image"]
        rest_ = [x for x in self.looks if x[0] != "mirror image"]
        if mirrored and k % 2 == 0:
            return mirrored[0]
        return rest_[((k // 2 if mirrored else k) + self.index) % len(rest_)]

    def loose_things(self, rng, kind, variant, cam, items):
        """Objects around the items that cover at most MAX_COVERED of each, if seven attempts find such objects."""
        count = {"clutter": int(rng.integers(8, 17)), "several": 2, "neg_other": [1, 4, 9, 12][variant]}[kind]
        area = cam.table(0).area
        small = self.pool + [b for b in self.others if max(b.size[:2]) < 75]
        pool = [b for b in small if b.size[0] * b.size[1] < area * 0.05] or self.pool
        if kind == "neg_other" and variant == 0:
            pool = self.others
        near = int(rng.integers(2, 6)) if kind == "clutter" else 0
        best, least = None, None
        for attempt in range(7):
            extra = scatter(rng, cam, items, pool, count, max(0, near - attempt) if attempt < 5 else 0)
            worst = max([h[0] for h in hidden(cam, items + extra, range(len(items)), 3)], default=0)
            if best is None or worst < least:
                best, least = extra, worst
            if worst <= MAX_COVERED:
                break
        while len({g["mat"] for body, _ in items + best for g in body.groups}) > SLOTS - 5:
            best.pop()
        return best

    def picture(self, kind, k):
        rng = stream(self.group.seed, self.name, kind, k)
        variant = (k + self.index) % 4
        s = self.setting(rng, kind, variant)
        items, taken, what = [], [], None
        for i in range(s.instances):
            where = self.view_place(rng, s.cam) if kind == "view" and i == 0 else None
            m, foot = self.place(rng, s.cam, self.body, taken, where, 0.35 if kind == "several" else 0.1)
            if m is None:
                break
            items.append((self.body, m))
            taken.append(foot)
        shown = len(items)
        if kind == "neg_look":
            what, body = self.look_alike(k)
            items.append((body, self.place(rng, s.cam, body)[0]))
        if kind in ("clutter", "neg_other") or (kind == "several" and variant == 3):
            items = items + self.loose_things(rng, kind, variant, s.cam, items)
        hid = hidden(s.cam, items, range(shown), 2)
        file = f"{kind}_{k}.jpg"
        entry = dict(
            image=file,
            present=shown > 0,
            kind=kind,
            light=s.style,
            table=s.ground,
            instances=[self.instance(s.cam, m, h) for (_, m), h in zip(items[:shown], hid)],
        )
        if kind.startswith("neg"):
            entry["lookalike"] = kind == "neg_look"
        if what:
            entry["what"] = what
        self.truth.append(entry)
        if self.due(f"{kind}_{k}", file):
            self.save(file, self.render(rng, s, items))

    def run(self):
        self.demo()
        for kind, count in self.group.pictures.items():
            for k in range(count):
                if self.wanted(f"{kind}_{k}"):
                    start = time.time()
                    self.picture(kind, k)
                    print(f"{self.name} {kind} {k} {time.time() - start:.1f} s", flush=True)
        if self.only is None:
            write_json(os.path.join(self.dir, "truth.json"), self.truth)


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("group", choices=GROUPS)
    args.add_argument("out")
    args.add_argument("--sets", help="names of parts, separated by commas (default: all)")
    args.add_argument("--only", help="demo, plain_0, ...: only these pictures, without truth.json")
    args.add_argument("--spp", type=int, default=10, help="samples per pixel")
    args.add_argument("--resume", action="store_true", help="keep pictures that exist")
    args = args.parse_args()
    group = GROUPS[args.group]
    only = args.only.split(",") if args.only else None
    for name in args.sets.split(",") if args.sets else group.parts:
        start = time.time()
        SetMaker(group, name, args.out, args.spp, only, args.resume).run()
        print(f"{name} done in {time.time() - start:.0f} s", flush=True)


if __name__ == "__main__":
    main()
