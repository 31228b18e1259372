"""Printed faces: pictures on a body's upper face."""

import os

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from materials import print_path
from meshes import CACHE
from surfaces import letters

PX = 16  # pixels per mm


def font(size):
    return ImageFont.load_default(size)


class Print:
    """A picture of w x h mm, drawn in mm with the origin at its centre, y up."""

    def __init__(self, w, h, ground):
        self.w, self.h = w, h
        self.picture = Image.new("RGB", (int(w * PX), int(h * PX)), ground)
        self.d = ImageDraw.Draw(self.picture)

    def at(self, x, y):
        return (x + self.w / 2) * PX, (self.h / 2 - y) * PX

    def box(self, x, y, dx, dy, fill=None, outline=None, width=0.0, r=0.0):
        """A rectangle around its centre."""
        (x0, y0), (x1, y1) = self.at(x - dx / 2, y + dy / 2), self.at(x + dx / 2, y - dy / 2)
        self.d.rounded_rectangle((x0, y0, x1, y1), r * PX, fill=fill, outline=outline, width=int(width * PX))

    def disc(self, x, y, r, fill=None, outline=None, width=0.0):
        (x0, y0), (x1, y1) = self.at(x - r, y + r), self.at(x + r, y - r)
        self.d.ellipse((x0, y0, x1, y1), fill=fill, outline=outline, width=int(width * PX))

    def line(self, points, fill, width):
        self.d.line([self.at(*p) for p in points], fill=fill, width=int(width * PX), joint="curve")

    def shape(self, points, fill):
        self.d.polygon([self.at(*p) for p in points], fill=fill)

    def text(self, x, y, text, size, fill):
        """Text of `size` mm around its centre."""
        self.d.text(self.at(x, y), text, fill=fill, font=font(int(size * PX)), anchor="mm")

    def save(self, name):
        os.makedirs(CACHE, exist_ok=True)
        self.picture.save(print_path(name))


def on_top(groups, name, w, h):
    """Gives the groups of the material print:NAME the texture coordinates of a print of w x h mm around the origin."""
    for g in groups:
        if g["mat"] == f"print:{name}":
            g["uv"] = g["v"][:, :2] / [w, h] + 0.5
    return groups


def board(name, seed, w, h, mask=(20, 84, 48), silk=(222, 226, 216), mark=None, label=None, drills=()):
    """A circuit board's upper face: traces, pads and a printed label. `mark` is a coloured dot (x, y, r, colour)."""
    rng = np.random.default_rng(seed)
    p = Print(w, h, mask)
    trace = tuple(min(255, int(c * 1.25 + 10)) for c in mask)
    for _ in range(26):
        x, y = rng.uniform(-w / 2, w / 2), rng.uniform(-h / 2, h / 2)
        points = [(x, y)]
        for _ in range(int(rng.integers(2, 5))):
            length, turn = rng.uniform(2, w / 4), rng.integers(8) * np.pi / 4
            points.append((points[-1][0] + length * np.cos(turn), points[-1][1] + length * np.sin(turn)))
        p.line(points, trace, rng.choice([0.3, 0.5, 0.9]))
    for _ in range(22):
        x, y = rng.uniform(-w / 2 + 2, w / 2 - 2), rng.uniform(-h / 2 + 2, h / 2 - 2)
        p.disc(x, y, 0.7, fill=(190, 170, 110))
        p.disc(x, y, 0.3, fill=(40, 40, 36))
    for _ in range(7):
        x, y = rng.uniform(-w / 2 + 6, w / 2 - 6), rng.uniform(-h / 2 + 4, h / 2 - 4)
        p.box(x, y, 3.4, 1.8, outline=silk, width=0.2)
        p.text(x, y + 2.0, f"{letters(rng, 1)}{rng.integers(1, 40)}", 1.6, silk)
    for x, y, r in drills:
        p.disc(x, y, r + 1.1, fill=(196, 178, 120))
    if label:
        x, y, text, size = label
        p.text(x, y, text, size, silk)
    if mark:
        x, y, r, colour = mark
        p.disc(x, y, r, fill=colour)
    p.save(name)
