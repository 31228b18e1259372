"""Tables and rooms: pictures painted from random numbers, and two sample pictures of scikit-image."""

import os
from dataclasses import dataclass

import numpy as np
from PIL import Image, ImageDraw, ImageFont

PLAIN = ["white", "grey", "black", "bluemat", "woodlight", "wooddark", "cardboard", "felt", "concrete", "greenmat"]
BUSY = ["cutting", "print", "brushed", "fabric", "plywood", "gravel", "newspaper", "granite"]

# Approximate lightness of the plain tables, on which the exposure depends.
LIGHTNESS = dict(
    white=0.85,
    grey=0.5,
    black=0.08,
    bluemat=0.3,
    woodlight=0.6,
    wooddark=0.25,
    cardboard=0.5,
    felt=0.3,
    concrete=0.5,
    greenmat=0.3,
)

SIZE = 1024  # pixels of a table's picture


@dataclass
class Table:
    """The pictures show `width_mm` of the table and repeat; `bump_mm` is the bump picture's height."""

    colour: Image.Image
    rough: float = 0.5
    metallic: float = 0.0
    width_mm: float = 500.0
    bump: Image.Image | None = None
    bump_mm: float = 0.0


def noise(rng, n, beta=1.6, ax=1.0, ay=1.0):
    """1/f noise on a torus, n x n, mean 0, standard deviation 1; ax, ay stretch it."""
    f = np.fft.rfft2(rng.standard_normal((n, n)))
    k = np.hypot(np.fft.rfftfreq(n)[None] * ax, np.fft.fftfreq(n)[:, None] * ay)
    k[0, 0] = 1
    f /= k**beta
    f[0, 0] = 0
    v = np.fft.irfft2(f, (n, n))
    return v / v.std()


def image(a):
    return Image.fromarray((np.clip(a, 0, 1) * 255).astype(np.uint8))


def tint(v, colour, amount):
    return np.clip(np.array(colour)[None, None] * (1 + amount * v[..., None]), 0, 1)


def font(size):
    return ImageFont.load_default(size)


def letters(rng, count, first="A"):
    return "".join(chr(ord(first) + c) for c in rng.integers(0, 26, count))


def text_block(rng, d, x, y, w, h, size, ink):
    for line in range(y, y + h, int(size * 1.4)):
        at = x
        while at < x + w - 3 * size:
            count = int(rng.integers(2, 9))
            d.text((at, line), letters(rng, count, "a"), fill=ink, font=font(size))
            at += int(size * 0.55 * count + size * 0.4)


def table(rng, kind):
    """Paints a table of one of the kinds in PLAIN and BUSY."""
    t = TABLES[kind](rng, noise(rng, SIZE, 1.0), rng.standard_normal((SIZE, SIZE)))
    if kind not in ("cutting", "print", "newspaper"):
        t.width_mm *= rng.uniform(0.85, 1.2)
    return t


# The painters: `cloud` is slow noise, `fine` is white noise.


def white(rng, cloud, fine):
    base = rng.uniform(0.78, 0.9) * np.array([1, 0.99, 0.96 + 0.03 * rng.random()])
    return Table(image(tint(cloud * 0.5 + fine * 0.3, base, 0.012)), rng.uniform(0.25, 0.5))


def grey(rng, cloud, fine):
    base = rng.uniform(0.4, 0.62) * np.array([1, 1, 1.02])
    return Table(image(tint(cloud + fine, base, 0.025)), rng.uniform(0.3, 0.6))


def black(rng, cloud, fine):
    base = rng.uniform(0.1, 0.17) * np.array([1, 1, 1.05])
    return Table(image(tint(cloud + fine, base, 0.06)), rng.uniform(0.4, 0.7))


def bluemat(rng, cloud, fine):
    base = np.array([0.2, 0.36, 0.62]) * rng.uniform(0.8, 1.15)
    bump = image(0.5 + 0.15 * fine)
    return Table(image(tint(cloud * 0.6 + fine * 0.8, base, 0.04)), 0.55, bump=bump, bump_mm=0.03)


def greenmat(rng, cloud, fine):
    base = np.array([0.22, 0.46, 0.36]) * rng.uniform(0.8, 1.1)
    return Table(image(tint(cloud * 0.6 + fine * 0.8, base, 0.04)))


def wood(base, contrast, stretch):
    def paint(rng, cloud, fine):
        wobble = noise(rng, SIZE, 1.8, 1, 6)
        y = np.arange(SIZE)[:, None] / SIZE
        rings = np.sin(2 * np.pi * (rng.integers(9, 22) * y + 0.9 * wobble))
        grain = noise(rng, SIZE, 0.8, 1, stretch)
        c = tint(0.55 * rings + 0.55 * grain + 0.25 * cloud, base, contrast) * np.array([1, 0.98, 0.95])
        rough = rng.uniform(0.3, 0.6)
        if rng.random() < 0.5:  # boards with joints
            width = int(rng.integers(170, 340))
            for y in range(0, SIZE, width):
                c[y : y + width] *= rng.uniform(0.86, 1.1)
                c[y : y + 2] *= 0.45
        return Table(image(c), rough, bump=image(0.5 + 0.12 * grain), bump_mm=0.06)

    return paint


def cardboard(rng, cloud, fine):
    flutes = np.sin(np.arange(SIZE)[None] * 2 * np.pi * 90 / SIZE)
    bump = image(0.5 + 0.1 * np.broadcast_to(flutes, (SIZE, SIZE)) + 0.05 * fine)
    c = tint(0.25 * flutes + 0.5 * cloud + 0.8 * fine, (0.66, 0.5, 0.34), 0.045)
    return Table(image(c), 0.8, bump=bump, bump_mm=0.08)


def felt(rng, cloud, fine):
    base = [(0.2, 0.22, 0.26), (0.5, 0.12, 0.12), (0.14, 0.34, 0.2), (0.55, 0.55, 0.56)][rng.integers(4)]
    return Table(image(tint(noise(rng, SIZE, 0.35) * 1.1 + 0.4 * cloud, base, 0.12)), 1.0, width_mm=260)


def concrete(rng, cloud, fine):
    base = rng.uniform(0.45, 0.62) * np.array([1.0, 0.98, 0.95])
    return Table(image(tint(noise(rng, SIZE, 0.9) + 0.5 * fine, base, 0.08)), 0.75)


def granite(rng, cloud, fine):
    v = noise(rng, SIZE, 0.3)
    grains = np.where(v > 1.1, 4, np.where(v < -1, -3, v))
    base = rng.uniform(0.3, 0.5) * np.array([1, 0.97, 0.95])
    return Table(image(tint(grains, base, 0.16)), 0.15, width_mm=420)


def brushed(rng, cloud, fine):
    lines = noise(rng, SIZE, 0.25, 0.02, 1)
    bump = image(0.5 + 0.1 * lines)
    return Table(image(tint(lines, (0.66, 0.66, 0.68), 0.05)), rng.uniform(0.28, 0.45), 1.0, bump=bump, bump_mm=0.02)


def fabric(rng, cloud, fine):
    y, x = np.mgrid[:SIZE, :SIZE]
    weave = np.sin(x * 2 * np.pi / 8) * np.sin(y * 2 * np.pi / 8)
    base = [(0.55, 0.5, 0.42), (0.25, 0.3, 0.42), (0.7, 0.68, 0.62)][rng.integers(3)]
    c = tint(weave + 0.6 * cloud + 0.5 * fine, base, 0.12)
    if rng.random() < 0.5:
        c[(y // 64 + x // 64) % 2 == 0] *= 0.75
    return Table(image(c), 0.95, width_mm=300, bump=image(0.5 + 0.2 * weave), bump_mm=0.15)


def gravel(rng, cloud, fine):
    import skimage

    path = os.path.join(os.path.dirname(skimage.__file__), "data", ["gravel.png", "brick.png"][rng.integers(2)])
    a = np.asarray(Image.open(path).convert("L").resize((SIZE, SIZE))) / 255.0
    c = a[..., None] * np.array([0.8, 0.76, 0.7]) * rng.uniform(0.7, 1.1)
    return Table(image(c), 0.9, width_mm=300, bump=image(a), bump_mm=0.4)


def cutting(rng, cloud, fine):
    """A green cutting mat with a grid of 10 mm."""
    picture = image(tint(cloud + fine, (0.1, 0.33, 0.27), 0.05))
    d = ImageDraw.Draw(picture)
    yellow, faint, width_mm = (215, 210, 120), (150, 160, 100), 450
    for k in range(46):
        a = int(k * 10 * SIZE / width_mm)
        style = dict(fill=yellow, width=2) if k % 5 == 0 else dict(fill=faint, width=1)
        d.line((a, 0, a, SIZE), **style)
        d.line((0, a, SIZE, a), **style)
        if k % 5 == 0:
            d.text((a + 4, 20), str(k), fill=yellow, font=font(16))
    d.line((0, 0, SIZE, SIZE), fill=yellow, width=2)
    return Table(picture, width_mm=width_mm)


def sheet_of_print(paper, columns):
    def paint(rng, cloud, fine):
        picture = image(tint(0.3 * cloud + 0.3 * fine, paper, 0.015))
        d = ImageDraw.Draw(picture)
        w = SIZE // columns
        for x in range(0, columns * w, w):
            d.text((x + 20, 30), letters(rng, 7), fill=(30, 30, 30), font=font(40))
            text_block(rng, d, x + 20, 90, w - 40, 380, 17, (50, 50, 55))
            x0, y0, ink = x + 30, 560, (40, 40, 40)
            if rng.random() < 0.6:
                for j in range(5):
                    bar = (x0 + j * 34, y0 + 160 - int(rng.integers(30, 150)), x0 + j * 34 + 24, y0 + 160)
                    d.rectangle(bar, outline=(40, 60, 120), fill=None if j % 2 else (110, 130, 180))
            else:
                d.ellipse((x0, y0, x0 + 150, y0 + 150), outline=ink, width=2)
                d.line((x0 - 20, y0 + 75, x0 + 175, y0 + 75), fill=ink)
                d.line((x0 + 75, y0 - 20, x0 + 75, y0 + 175), fill=ink)
            text_block(rng, d, x + 20, 740, w - 40, 260, 17, (50, 50, 55))
        return Table(picture, 0.75, width_mm=420)

    return paint


TABLES = dict(
    white=white,
    grey=grey,
    black=black,
    bluemat=bluemat,
    greenmat=greenmat,
    woodlight=wood((0.76, 0.6, 0.42), 0.1, 0.04),
    wooddark=wood((0.4, 0.26, 0.17), 0.1, 0.04),
    plywood=wood((0.82, 0.7, 0.52), 0.06, 0.08),
    cardboard=cardboard,
    felt=felt,
    concrete=concrete,
    granite=granite,
    brushed=brushed,
    fabric=fabric,
    gravel=gravel,
    cutting=cutting,
    print=sheet_of_print((0.9, 0.89, 0.86), 2),
    newspaper=sheet_of_print((0.78, 0.75, 0.68), 4),
)


def room(rng, style):
    """A room seen from the table, 128 x 256, z up: ceiling, walls with furniture, windows or lamps.

    Linear radiance, scaled so that the irradiance on the table is about 1.
    """
    h, w = 128, 256
    horizon = h // 2
    e = np.zeros((h, w, 3), np.float32)
    elevation = (0.5 - (np.arange(h) + 0.5) / h) * np.pi
    top = int(h * rng.uniform(0.2, 0.3))
    e[:top] = np.array([0.9, 0.88, 0.84]) * rng.uniform(0.25, 0.6)
    e[top : horizon + 6] = rng.uniform([0.5, 0.48, 0.42], [0.8, 0.8, 0.8]) * rng.uniform(0.15, 0.4)
    e[horizon + 6 :] = np.array([0.25, 0.2, 0.16]) * 0.4
    for _ in range(int(rng.integers(8, 18))):  # furniture
        x, y = rng.integers(0, w), rng.integers(top, horizon)
        dx, dy = rng.integers(4, 28), rng.integers(6, 40)
        e[y : min(y + dy, horizon + 6), x : x + dx] = rng.uniform(0.02, 0.5, 3) * rng.uniform(0.2, 1)

    def add(x0, x1, y0, y1, c):
        e[max(0, y0) : min(h, y1), np.arange(x0, x1) % w] = c

    if style in ("window", "mixed"):
        cool = np.array([0.82, 0.92, 1.0])
        for _ in range(int(rng.integers(1, 3))):
            x, dx = int(rng.integers(0, w)), int(rng.integers(18, 44))
            y0 = int(rng.integers(top - 4, top + 8))
            y1 = y0 + int(rng.integers(16, 30))
            add(x, x + dx, y0, y1, cool * rng.uniform(6, 14))
            for k in range(0, dx, max(6, dx // 3)):  # bars
                add(x + k, x + k + 1, y0, y1, 0.2 * cool)
    if style in ("office", "mixed"):
        for _ in range(int(rng.integers(2, 5))):  # ceiling lamps
            x, y = int(rng.integers(0, w)), int(rng.integers(6, top))
            dx = int(rng.integers(10, 34) * (1 + 6.0 / (y + 4)))
            add(x, x + dx, y, y + int(rng.integers(3, 7)), np.array([1.0, 0.96, 0.9]) * rng.uniform(6, 16))
    if style == "evening":
        x, y = int(rng.integers(0, w)), int(rng.integers(8, top + 6))
        add(x, x + 12, y, y + 8, np.array([1.0, 0.78, 0.52]) * rng.uniform(25, 50))
        e *= np.array([1, 0.85, 0.68], np.float32)
    if style == "overcast":
        sky = 0.6 + 0.9 * np.clip(np.sin(elevation[:horizon]), 0, 1)
        e[:horizon] = np.array([0.9, 0.95, 1.0]) * sky[:, None, None]
        x = int(rng.integers(0, w))
        add(x, x + 60, top, horizon + 6, np.array([0.12, 0.12, 0.1]))
        add(x + 100, x + 170, top + 10, horizon + 6, np.array([0.2, 0.15, 0.1]))
    weight = (np.sin(elevation) * np.cos(elevation))[:horizon, None, None]
    irradiance = (e[:horizon] * weight).sum((0, 1)).mean() * (np.pi / h) * (2 * np.pi / w)
    return (e / irradiance).astype(np.float32)
