"""Draws the parts of a group and checks them, without rendering.

Usage: check_parts.py GROUP [part,part] [--sheet FILE.png]

Prints sizes, triangles and grasp lines, and the fraction of the plan view that differs between the part and each
look-alike at the best rotation. The sheet shows each part and its look-alikes from above, with the ends of the grasp line.
"""

import argparse
import math

import cv2
import numpy as np

import camera  # noqa: F401 (sets Mitsuba's variant)
import materials
import parts_roll
import parts_tune
import parts_untuned
from bodies import Body, grasp_ends


def plan(body, cell, mm_per_px):
    """Shaded plan view and heights of a body, (cell, cell, 3) and (cell, cell)."""
    picture = np.full((cell, cell, 3), 255, np.uint8)
    height = np.full((cell, cell), -1.0)
    for g in body.groups:
        if g["mat"].startswith("print:"):
            colour = cv2.imread(materials.print_path(g["mat"][6:]))
        elif ":" in g["mat"]:
            colour = np.array([float(c) for c in g["mat"].split(":")[1].split(",")][::-1]) * 255
        else:
            colour = np.full(3, 255 * materials.lightness(g["mat"]) * 0.9)
        for tri in g["f"]:
            v = g["v"][tri]
            normal = np.cross(v[1] - v[0], v[2] - v[0])
            if normal[2] <= 1e-9:
                continue
            q = np.column_stack([v[:, 0], -v[:, 1]]) / mm_per_px + cell / 2
            x0, y0 = np.maximum(0, np.floor(q.min(0)).astype(int))
            x1, y1 = np.minimum(cell - 1, np.ceil(q.max(0)).astype(int))
            if x1 < x0 or y1 < y0:
                continue
            xs, ys = np.meshgrid(np.arange(x0, x1 + 1) + 0.5, np.arange(y0, y1 + 1) + 0.5)
            a = np.column_stack([q, np.ones(3)])
            if abs(np.linalg.det(a)) < 1e-9:
                continue
            w = np.stack([xs, ys, np.ones_like(xs)], -1) @ np.linalg.inv(a)
            z = w @ v[:, 2]
            inside = (w >= -1e-6).all(-1) & (z > height[y0 : y1 + 1, x0 : x1 + 1])
            shade = 0.55 + 0.45 * normal[2] / np.linalg.norm(normal)
            if colour.ndim == 3:
                uv = w @ g["uv"][tri]
                c = colour[
                    np.clip(((1 - uv[..., 1]) * colour.shape[0]).astype(int), 0, colour.shape[0] - 1),
                    np.clip((uv[..., 0] * colour.shape[1]).astype(int), 0, colour.shape[1] - 1),
                ]
            else:
                c = np.broadcast_to(colour * (0.7 + 0.3 * v[:, 2].mean() / max(1, body.size[2])), (*z.shape, 3))
            picture[y0 : y1 + 1, x0 : x1 + 1][inside] = (c * shade)[inside].clip(0, 255)
            height[y0 : y1 + 1, x0 : x1 + 1][inside] = z[inside]
    return picture, height


def difference(a, b, picture_a, picture_b):
    """Minimum over rotations in steps of 3° of the fraction of the views' union that differs in height or colour."""
    least = 1.0
    n = a.shape[0]
    for turn in range(0, 360, 3):
        m = cv2.getRotationMatrix2D((n / 2 - 0.5, n / 2 - 0.5), turn, 1)
        h = cv2.warpAffine(b.astype(np.float32), m, (n, n), flags=cv2.INTER_NEAREST, borderValue=-1)
        p = cv2.warpAffine(picture_b, m, (n, n), flags=cv2.INTER_NEAREST, borderValue=(255, 255, 255))
        union = (a >= 0) | (h >= 0)
        colour = np.abs(p.astype(int) - picture_a).max(-1) > 60
        least = min(least, ((np.abs(a - h) > 1.0) | colour)[union].mean())
    return least


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("group", choices=["tune", "roll", "untuned"])
    args.add_argument("parts", nargs="?")
    args.add_argument("--sheet")
    args = args.parse_args()
    table = dict(tune=parts_tune, roll=parts_roll, untuned=parts_untuned)[args.group].PARTS
    rows = []
    for name in args.parts.split(",") if args.parts else table:
        spec = table[name]
        row = []
        for k, (what, make) in enumerate([("part", spec["make"])] + spec["look"]):
            try:
                body = Body.get(f"{name}_{k}", make)
            except Exception as e:
                print(f"{name} {what}: FAILED {e!r}")
                continue
            if k == 0:
                cell, mm_per_px = 240, 1.3 * np.hypot(*body.size[:2]) / 240
                f = 320 / math.tan(math.radians(spec["cam"][1] / 2))
                px = f * np.hypot(*body.size[:2]) / spec["cam"][0]
                ends = grasp_ends(body, spec)
            picture, height = plan(body, cell, mm_per_px)
            if k == 0:
                first = height, picture.copy()
                on = [body.top(*e[:2]) for e in ends]
                text = f"{px:.0f} px, grasp {np.round(ends, 1).tolist()}, solid under {[v is not None for v in on]}"
                text += f", fold {spec['sym']}, chiral {spec['chiral']}"
                for e in ends:
                    at = (int(e[0] / mm_per_px + cell / 2), int(-e[1] / mm_per_px + cell / 2))
                    cv2.circle(picture, at, 3, (0, 0, 255), -1)
            else:
                text = f"differs in {100 * difference(first[0], height, first[1], picture):.1f} %"
            size = " x ".join(f"{v:.1f}" for v in body.size)
            print(f"{name} {what}: {size} mm, {len(body.tf)} triangles, {text}", flush=True)
            cv2.putText(picture, f"{name if k == 0 else what}", (4, 14), 0, 0.42, (200, 0, 0), 1)
            row.append(picture)
        rows.append(row)
    if args.sheet:
        width = max(len(r) for r in rows)
        blank = np.full((240, 240, 3), 255, np.uint8)
        cv2.imwrite(args.sheet, np.vstack([np.hstack(r + [blank] * (width - len(r))) for r in rows]))


if __name__ == "__main__":
    main()
