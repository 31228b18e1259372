"""Surfaces of bodies as Mitsuba BSDF dictionaries.

A material's name is one of `NAMES`, or `KIND:R,G,B` with an sRGB colour from 0 to 1 and one of the kinds paint,
plastic, rubber, board (solder mask), metal, glass, blank (an empty print, grey by R); or `print:NAME`, a picture drawn
by `prints.py`.

Numbers that differ between materials are stored in pictures of one size instead of the dictionary, so Dr.Jit compiles
its kernels once for all scenes.
"""

import os

import mitsuba as mi
import numpy as np
from PIL import Image, ImageDraw

import meshes
from surfaces import noise

# A scene has at least one of each, because a scene with another set of BSDF types needs a new compilation.
FILLER = "plastic:0.1,0.1,0.1"
ONE_OF_EACH_TYPE = ("zinc", "blackox", FILLER, "paint:0.4,0.4,0.4", "blank")


def linear(rgb):
    return tuple(float(max(0.0, x)) ** 2.2 for x in rgb)


def bumps(rng, kind):
    n = 512
    if kind == "brushed":
        v = noise(rng, n, 0.3, 0.03, 1)
    elif kind == "coarse":
        v = noise(rng, n, 0.8)
    elif kind == "scratch":
        picture = Image.new("L", (n, n), 128)
        d = ImageDraw.Draw(picture)
        for _ in range(160):
            x, y, a, length = rng.uniform(0, n), rng.uniform(0, n), rng.uniform(0, 6.3), rng.uniform(10, 120)
            end = (x + length * np.cos(a), y + length * np.sin(a))
            d.line((x, y, *end), fill=int(rng.integers(95, 165)), width=1)
        v = (np.asarray(picture) / 255.0 - 0.5) * 6 + 0.5 * noise(rng, n, 0.6)
    else:
        v = noise(rng, n, 0.25)
    return 0.14 * v


def rgb(c):
    return {"type": "rgb", "value": [float(x) for x in c]}


def bitmap(a, raw=False, wrap="repeat"):
    return {"type": "bitmap", "bitmap": mi.Bitmap(np.array(a)), "raw": raw, "wrap_mode": wrap}


class Painter:
    """Makes BSDFs; `rng` depends on the set and the material, so a part keeps its surface."""

    def __init__(self, rng):
        self.rng = rng
        self.u = rng.uniform

    def bumped(self, bsdf, kind, mm):
        height = (bumps(self.rng, kind) * mm)[..., None].astype(np.float32)
        return {"type": "twosided", "b": {"type": "bumpmap", "t": bitmap(height, True), "scale": 1.0, "b": bsdf}}

    def uneven(self, value):
        v = np.clip(value * (1 + 0.14 * noise(self.rng, 512, 1.2)), 0.06, 0.9)
        return bitmap(v[..., None].astype(np.float32), True)

    def conductor(self, metal, alpha, kind, mm, tint=(1, 1, 1)):
        """Measured metal: Cr, Al, Au, Cu."""
        bsdf = {
            "type": "roughconductor",
            "material": metal,
            "alpha": self.uneven(alpha),
            "distribution": "ggx",
            "specular_reflectance": rgb(tint),
        }
        return self.bumped(bsdf, kind, mm)

    def metal(self, base, rough, kind="scratch", mm=0.02, metallic=1.0):
        bsdf = {
            "type": "principled",
            "base_color": rgb(base),
            "metallic": bitmap(np.full((8, 8, 1), metallic, np.float32), True),
            "roughness": self.uneven(rough),
            "specular": 0.5,
        }
        return self.bumped(bsdf, kind, mm)

    def plastic(self, c, mm=0.01):
        bsdf = {
            "type": "roughplastic",
            "diffuse_reflectance": rgb(np.clip(c, 0.008, 0.8)),
            "alpha": 0.2,
            "distribution": "ggx",
        }
        return self.bumped(bsdf, "fine", mm)

    def coated(self, c, rough, kind, mm):
        bsdf = {
            "type": "principled",
            "base_color": rgb(c),
            "roughness": self.uneven(rough),
            "specular": 0.5,
            "clearcoat": 0.5,
            "clearcoat_gloss": 0.82,
        }
        return self.bumped(bsdf, kind, mm)

    def printed(self, picture):
        bsdf = {
            "type": "principled",
            "base_color": bitmap(picture, False, "clamp"),
            "roughness": self.uneven(self.u(0.3, 0.45)),
            "specular": 0.5,
        }
        return self.bumped(bsdf, "fine", 0.004)


NAMES = dict(
    zinc=lambda p: p.conductor("Cr", p.u(0.16, 0.26), "scratch", 0.015, p.u([0.9, 0.9, 0.86], [1.0, 1.0, 1.0])),
    steel=lambda p: p.conductor("Cr", p.u(0.1, 0.2), "brushed", 0.006),
    alu=lambda p: p.conductor("Al", p.u(0.22, 0.34), "brushed", 0.012, (0.86, 0.87, 0.88)),
    tin=lambda p: p.conductor("Al", p.u(0.2, 0.3), "scratch", 0.012, (0.78, 0.77, 0.74)),
    copper=lambda p: p.conductor("Cu", p.u(0.16, 0.26), "scratch", 0.01, (0.95, 0.92, 0.9)),
    brass=lambda p: p.conductor("Au", p.u(0.14, 0.24), "scratch", 0.012, (0.80, 0.84, 0.86)),
    brassplate=lambda p: p.conductor("Au", p.u(0.2, 0.3), "brushed", 0.01, (0.78, 0.84, 0.9)),
    bronze=lambda p: p.conductor("Cu", p.u(0.26, 0.36), "coarse", 0.04, (0.78, 0.86, 0.8)),
    blackox=lambda p: p.metal((0.03, 0.03, 0.034), p.u(0.28, 0.4), "scratch", 0.015, 0.6),
    anodblack=lambda p: p.metal((0.02, 0.02, 0.022), p.u(0.3, 0.42), "fine", 0.01, 0.6),
    anodblue=lambda p: p.metal((0.03, 0.1, 0.4), p.u(0.3, 0.42), "fine", 0.01, 0.8),
    cast=lambda p: p.metal(p.u([0.16, 0.16, 0.17], [0.28, 0.28, 0.3]), p.u(0.42, 0.55), "coarse", 0.12, 0.7),
    galv=lambda p: p.metal((0.55, 0.57, 0.6), p.u(0.3, 0.4), "coarse", 0.03, 1.0),
    blank=lambda p: p.printed(np.full((512, 1024, 3), 128, np.uint8)),
)

COLOURED = dict(
    paint=lambda p, c: p.coated(c, p.u(0.25, 0.4), "coarse", 0.03),
    board=lambda p, c: p.coated(c, p.u(0.3, 0.45), "fine", 0.008),
    plastic=lambda p, c: p.plastic(c, p.u(0.004, 0.012)),
    rubber=lambda p, c: p.metal(c, p.u(0.6, 0.75), "fine", 0.02, 0.0),
    metal=lambda p, c: p.metal(c, p.u(0.22, 0.34), "scratch", 0.01, 1.0),
    glass=lambda p, c: p.metal(c, 0.07, "fine", 0.0005, 0.0),
    blank=lambda p, c: p.printed(np.full((512, 1024, 3), int(255 * c[0]), np.uint8)),
)


def print_path(name):
    return os.path.join(meshes.CACHE, f"print_{name}.png")


def material(name, rng):
    """The BSDF of a material's name."""
    painter = Painter(rng)
    if name.startswith("print:"):
        picture = Image.open(print_path(name[6:])).convert("RGB").resize((1024, 512), Image.LANCZOS)
        return painter.printed(picture.transpose(Image.FLIP_TOP_BOTTOM))
    if ":" in name:
        kind, colour = name.split(":")
        return COLOURED[kind](painter, linear([float(x) for x in colour.split(",")]))
    return NAMES[name](painter)


def lightness(name):
    """Approximate lightness of a material, 0 to 1; the choice of the table depends on it."""
    if ":" in name and not name.startswith("print:"):
        c = linear([float(x) for x in name.split(":")[1].split(",")])
        return float(np.dot(c, (0.25, 0.65, 0.1))) ** (1 / 2.2)
    return dict(
        blackox=0.15, anodblack=0.12, anodblue=0.3, cast=0.4, bronze=0.5, brass=0.6, brassplate=0.6, copper=0.55
    ).get(name, 0.75)
