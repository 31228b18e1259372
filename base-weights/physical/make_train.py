"""Renders pictures of random parts and their look-alikes for training the details network. Usage:

    make_train.py OUT FIRST LAST [--pictures 6] [--spp 8]

Part N of FIRST to LAST - 1 gets the folder OUT/r_N with `demo.jpg`, `demo.json` and `set.json` (as `make_sets.py`
writes them), pictures `mixed_K.jpg` that show the part and its look-alikes separately, `ids_K.png` (the object at each
pixel: 0 the table, k + 1 the k-th object) and `pairs.json`: for each object in a picture the ends of the grasp line, in
pixels, of the part aligned with the object (at the angle and position at which the two look most alike from above), and
the object's difference from the part (null: it is the part). A part whose folder has `pairs.json` is not rendered
again. The number determines the part; parts from number 1000 are tall.
"""

import argparse
import math
import os
import time

import cv2
import numpy as np

import camera  # noqa: F401 (sets Mitsuba's variant; must precede everything that uses Mitsuba)
import clutter
import parts_train
import photo
import quotas
import scene
import surfaces
from bodies import Body, grasp_ends, lift
from camera import WIDTH, cast
from make_sets import Group, SetMaker, Setting, choose_table, write_json
from meshes import rot
from plan_views import CELL, best_cover, plan_view
from scatter import scatter
from scene import stream

SEED = "train 2026-1"
STYLES = ["soft", "plain", "plain", "sun", "lamp", "glare", "dark", "colour"]
TALL_FROM = 1000  # parts from this number on are tall
NUM_CHANGED = 7  # look-alikes with one thing changed
MIN_LOOKS = 4  # look-alikes that differ enough; a part with fewer is replaced by a new one
MAX_ATTEMPTS = 20
MIN_PLAN_PIXELS = 900  # area of the part in its plan view
MIN_TURNED_SHARE = 0.035  # a part that differs less from itself at another angle has an ambiguous pose
MIN_RIVAL_SHARE = 0.008  # a look-alike that differs less cannot be distinguished from above
MIRROR_TURNS = range(0, 360, 4)
CHANGED_TURNS = range(-6, 7, 2)


def limit_lamps():
    """Keeps 15 of the 28 lamps, because Dr.Jit compiles its kernels once per lamp."""
    scene.SIDE_LAMPS = scene.SIDE_LAMPS[:12]
    scene.OVERHEAD_LAMPS = scene.OVERHEAD_LAMPS[:3]


def material_names(items):
    return {g["mat"] for body, _ in items for g in body.groups}


class TrainMaker(SetMaker):
    """Generates and renders one random part with its look-alikes."""

    scene_type = quotas.QuotaScene

    def __init__(self, number, root, spp, pictures):
        # The parent's initialiser is not called, because it takes the part from a list.
        self.group = Group("train", {}, clutter.TUNE, SEED, {})
        self.name, self.spp, self.only, self.resume = f"r_{number:04d}", spp, None, True
        self.index, self.count = number, pictures
        self.dir = os.path.join(root, self.name)
        rng = self.draw_part(number)
        os.makedirs(self.dir, exist_ok=True)
        diagonal = float(np.hypot(*self.body.size[:2]))
        fov = float(rng.uniform(45, 58))
        f = WIDTH / 2 / math.tan(math.radians(fov) / 2)
        self.spec = dict(cam=(f * diagonal / rng.uniform(115, 185), fov), chiral=True, sym=1)
        self.others = []
        self.pool = [Body.get(f"c_tune_{c}", make) for c, make in clutter.TUNE.items()]
        self.marks, self.lift = grasp_ends(self.body, self.spec), lift(self.body, self.spec)
        self.bsdfs = {}
        self.truth = []
        self.height, self.fov = self.spec["cam"]
        self.k1 = float(rng.uniform(-0.05, 0.015))
        self.faults = photo.Faults.draw(rng)
        self.ground = choose_table(rng, self.body)
        self.diag_px = self.demo_scale = None

    def draw_part(self, number):
        """Generates parts until one has an unambiguous pose and enough look-alikes; returns the random generator."""
        for attempt in range(MAX_ATTEMPTS):
            rng = stream(SEED, number, attempt)
            r = parts_train.recipe(rng, number >= TALL_FROM)
            name = f"{self.name}_{attempt}"
            try:
                self.body = Body(f"{name}_0", lambda r=r, name=name: parts_train.build(r, name))
                self.mm = 1.35 * float(np.hypot(*self.body.size[:2])) / CELL
                self.plan = plan_view(self.body, self.mm)
                if (self.plan[0] > 0).sum() < MIN_PLAN_PIXELS:
                    continue
                if best_cover(self.plan, self.plan, range(12, 349, 6))[0] < MIN_TURNED_SHARE:
                    continue
                self.looks = self.rivals(rng, r, name)
                if len(self.looks) >= MIN_LOOKS:
                    return rng
            except Exception as e:  # OpenCASCADE raises several types of exception if a drawing is impossible
                print(f"{name}: {e!r}", flush=True)
        raise SystemExit(f"{self.name}: no attempt gave a part")

    def rivals(self, rng, r, name):
        """(difference, body, part's pose on it) of the look-alikes that can be distinguished from above."""
        out = []
        for k, (what, make) in enumerate(parts_train.looks(rng, r, name, NUM_CHANGED)):
            try:
                body = Body(f"{name}_{k + 1}", make)
                view = plan_view(body, self.mm)
            except Exception as e:  # OpenCASCADE, as above
                print(f"{name} {what}: {e!r}", flush=True)
                continue
            turns = MIRROR_TURNS if what == "mirror image" else CHANGED_TURNS
            share, turn, dx, dy = best_cover(self.plan, view, turns)
            if share > MIN_RIVAL_SHARE:
                rival_from_part = rot("z", turn)
                rival_from_part[:2, 3] = [dx * self.mm, -dy * self.mm]
                out.append((what, body, rival_from_part))
        return out

    def mixed_setting(self, rng):
        tilt = (0, 3) if rng.random() < 0.6 else (3, 12)
        s = Setting(self.camera(rng, tilt=tilt, dist=(0.9, 1.12)), self.ground)
        s.style = STYLES[rng.integers(len(STYLES))]
        tables = surfaces.PLAIN + surfaces.BUSY
        if rng.random() < 0.75:
            s.ground = tables[rng.integers(len(tables))]
        if s.style == "dark":
            s.exposure, s.noise_gain = rng.uniform(0.03, 0.06), 3.0
        s.sheet = rng.random() < 0.15
        return s

    def choose_things(self, rng, k):
        """Objects of a picture as (difference or None, body, part's pose on it): the part twice and three look-alikes."""
        chosen = list(rng.permutation(len(self.looks))[:3])
        if k % 2 == 0 and 0 not in chosen and self.looks[0][0] == "mirror image":
            chosen[0] = 0
        return [(None, self.body, np.eye(4))] * 2 + [self.looks[c] for c in chosen]

    def add_clutter(self, rng, cam, items):
        """The items with loose objects scattered among them, as far as the scene has slots for their materials."""
        small = [b for b in self.pool if max(b.size[:2]) < 45] or self.pool
        out = items + scatter(rng, cam, items, small, 6, 3)
        while not quotas.fits(material_names(out)) and len(out) > len(items):
            out.pop()
        return out

    def mixed(self, k):
        """Renders picture `k`; returns its entry of pairs.json."""
        rng = stream(SEED, self.name, "mixed", k)
        s = self.mixed_setting(rng)
        items, taken, about = [], [], []
        for what, body, thing_from_part in self.choose_things(rng, k):
            if not quotas.fits(material_names([*items, (body, None)])):
                continue
            m, foot = self.place(rng, s.cam, body, taken, None, 0.15)
            if m is None:
                continue
            items.append((body, m))
            taken.append(foot)
            about.append((what, m @ thing_from_part))
        if k % 3 == 2:
            items = self.add_clutter(rng, s.cam, items)
        ids = cast(s.cam, items, 1) + 1
        cv2.imwrite(os.path.join(self.dir, f"ids_{k}.png"), ids.astype(np.uint8))
        entries = []
        for i, (what, m) in enumerate(about):
            alone = cast(s.cam, [items[i]], 2) == 0
            seen = (ids[::2, ::2] == i + 1) & alone
            visible = round(float(seen.sum() / max(1, alone.sum())), 3)
            ends = self.instance(s.cam, m)["points_px"]
            entries.append(dict(what=what, id=i + 1, points_px=ends, visible=visible))
        self.save(f"mixed_{k}.jpg", self.render(rng, s, items))
        return dict(image=f"mixed_{k}.jpg", ids=f"ids_{k}.png", light=s.style, table=s.ground, things=entries)

    def run(self):
        self.demo()
        write_json(os.path.join(self.dir, "pairs.json"), [self.mixed(k) for k in range(self.count)])


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("out")
    args.add_argument("first", type=int)
    args.add_argument("last", type=int)
    args.add_argument("--pictures", type=int, default=6, help="pictures per part")
    args.add_argument("--spp", type=int, default=8, help="samples per pixel")
    args = args.parse_args()
    limit_lamps()
    for number in range(args.first, args.last):
        if os.path.exists(os.path.join(args.out, f"r_{number:04d}", "pairs.json")):
            continue
        start = time.time()
        maker = TrainMaker(number, args.out, args.spp, args.pictures)
        drawn = time.time() - start
        maker.run()
        seconds = f"drawn in {drawn:.1f} s, in all {time.time() - start:.1f} s"
        print(f"{maker.name}: {len(maker.looks)} look-alikes, {seconds}", flush=True)


if __name__ == "__main__":
    main()
