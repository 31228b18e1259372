"""Random pairs of a photo and a picture for the training of the network of the details.

Legend: B pairs, N = 128 pixels per side of the network's input, C = 16 cells of 8 pixels per side. A pair's transforms
map pixels of the network's input to pixels of the crops, both relative to the centre.
"""

import math
from dataclasses import dataclass

import numpy as np
import torch
import torch.nn.functional as F

import details_crops as crops_
from details_crops import expose
from details_faults import CELL, SIDE, bar, camera, column, edit, uniform

# Content of a pair's picture: the part, a look-alike, the part (with the picture or the photo edited), the part rotated
# or shifted, something else; and the fraction of each kind.
RIGHT, RIVAL, EDITED, TURNED, SHIFTED, ELSE = range(6)
MIX = (0.40, 0.30, 0.16, 0.04, 0.05, 0.05)
MIN_INSIDE = 0.3  # minimum fraction of a counted cell inside the outline
MIN_CHANGE = 0.05  # minimum mean change of an edited cell that counts as different
MIN_DOUBT = 0.015  # minimum mean change of an edited cell that does not count as the same
BAR_SHARE = 0.08  # fraction of right pairs and look-alikes with bars across the part
THING_SHARE = 0.15  # fraction of right pairs and look-alikes that another object covers
COARSE_SHARE = 0.25  # fraction of pairs whose picture is small, half of them with a small photo
SHADE_SHARE = 0.15  # fraction of pictures with the edge of a shadow
MAX_RIVAL_COVER = 0.12  # maximum covered fraction of a look-alike: more may hide the difference
MAX_COVER = 0.45  # maximum covered fraction of the part
LARGE_ERROR_SHARE, LARGE_ERROR = 0.25, 2.5  # fraction of poses with a larger error, and its factor


@dataclass
class Batch:
    """`weight` and `cell_weight` are 0 where the ground truth is unknown; the target of a cell is 1 where it differs."""

    x: torch.Tensor  # [B, 8, N, N]: photo RGB, picture RGB, in the outline, picture valid
    target: torch.Tensor  # [B], 1: the picture shows the part
    weight: torch.Tensor  # [B]
    cell_target: torch.Tensor  # [B, C, C]
    cell_weight: torch.Tensor  # [B, C, C]


def affine(angle, scale, shear, tx, ty, flip):
    """Matrices [B, 2, 2] and shifts [B, 2] in pixels; `flip` is -1 for mirrored pairs."""
    c, s = torch.cos(angle) * scale, torch.sin(angle) * scale
    a = torch.stack([torch.stack([c * flip, -s + shear], -1), torch.stack([s * flip, c], -1)], 1)
    return a, torch.stack([tx, ty], -1)


def sample(x, a, t, mode="bilinear"):
    """The network's input [B, ., N, N] from crops [B, ., S, S]; 0 outside."""
    theta = torch.cat([a * (SIDE / crops_.SIDE), t[:, :, None] / (crops_.SIDE / 2)], 2)
    grid = F.affine_grid(theta, (len(x), 1, SIDE, SIDE), align_corners=False)
    return F.grid_sample(x, grid, mode=mode, padding_mode="zeros", align_corners=False)


def sample_numbers(x, a, t):
    """Integers [B, N, N] from crops [B, S, S]; -1 outside."""
    return sample((x + 1)[:, None].float(), a, t, "nearest")[:, 0] - 1


def coarse(x, side):
    """Pictures [., 3, N, N] with the resolution of `side` pixels."""
    small = F.interpolate(x, size=(side, side), mode="area")
    return F.interpolate(small, size=(SIDE, SIDE), mode="bilinear", align_corners=False)


def cell_means(x):
    """Means over cells: [B, C, C] from [B, N, N]."""
    return F.avg_pool2d(x[:, None], CELL)[:, 0]


class Pairs:
    """Samples batches from the parts that are not held out."""

    def __init__(self, crops):
        self.crops, self.device = crops, crops.device
        kinds, visible = crops.kinds, crops.visible
        self.demo = crops.rows(kinds == crops_.DEMO)
        self.clean = crops.rows((kinds <= crops_.RIGHT) & (visible > 0.985))
        self.right = crops.rows((kinds == crops_.RIGHT) & (visible > 0.55))
        self.rival = crops.rows((kinds == crops_.RIVAL) & (visible > 0.8))
        self.elsewhere = crops.rows(kinds == crops_.ELSEWHERE)
        has_both = (self.right.count.cpu().numpy() > 0) & (self.rival.count.cpu().numpy() > 0)
        self.parts = torch.from_numpy(np.nonzero(has_both & ~crops.held_out)[0]).to(self.device)
        self.mix = torch.tensor(MIX).cumsum(0).to(self.device)

    def uniform(self, n, lo=0.0, hi=1.0):
        return uniform(n, self.device, lo, hi)

    def random_parts(self, n):
        return self.parts[torch.randint(len(self.parts), (n,), device=self.device)]

    def choose(self, n):
        """Kinds of pairs, parts, and the crops of photos and pictures, each [B]."""
        p = self.random_parts(n)
        kind = (self.uniform(n)[:, None] > self.mix[None]).sum(1).clamp(max=ELSE)
        demo, clean = self.demo.pick(p), self.clean.pick(p)
        photo = torch.where(self.uniform(n) < 0.5, demo, clean)
        picture = self.right.pick(p)
        # A photo is not compared with itself: sample once more, then use the demonstration.
        picture = torch.where(picture == photo, self.right.pick(p), picture)
        photo = torch.where(picture == photo, demo, photo)
        picture = torch.where(kind == RIVAL, self.rival.pick(p), picture)
        another = self.random_parts(n)
        has_elsewhere = (self.uniform(n) < 0.7) & (self.elsewhere.count[p] > 0)
        other = torch.where(has_elsewhere, self.elsewhere.pick(p), self.right.pick(another))
        return kind, p, photo, torch.where(kind == ELSE, other, picture)

    def transforms(self, n, kind):
        """Transforms of the photos and the pictures: the same rotation and flip for both, and an error of the pose."""
        turn = torch.randint(4, (n,), device=self.device) * (math.pi / 2) + torch.randn(n, device=self.device) * 0.12
        flip = torch.where(self.uniform(n) < 0.5, -1.0, 1.0)
        none = torch.zeros(n, device=self.device)
        scale = self.uniform(n, 0.97, 1.06)
        a, t = affine(turn, scale, none, self.uniform(n, -2, 2), self.uniform(n, -2, 2), flip)
        large = torch.where(self.uniform(n) < LARGE_ERROR_SHARE, LARGE_ERROR, 1.0)

        def error(sigma):
            return torch.randn(n, device=self.device) * sigma * large

        angle, tx, ty = error(0.012), error(0.8), error(0.8)
        wrong_turn = self.uniform(n, 0.22, 2 * math.pi - 0.22)
        wrong_turn = torch.where(self.uniform(n) < 0.4, torch.full_like(wrong_turn, math.pi), wrong_turn)
        angle = torch.where(kind == TURNED, wrong_turn, angle)
        direction, distance = self.uniform(n, 0, 2 * math.pi), self.uniform(n, 6, 16)
        tx = torch.where(kind == SHIFTED, distance * torch.cos(direction), tx)
        ty = torch.where(kind == SHIFTED, distance * torch.sin(direction), ty)
        error_a, error_t = affine(angle, 1 + error(0.008), error(0.01), tx, ty, torch.ones(n, device=self.device))
        return (a, t), (error_a @ a, (error_a @ t[:, :, None])[:, :, 0] + error_t)

    def edit_pairs(self, kind, photo, picture, inside):
        """Edits the photo or the picture of pairs of the kind EDITED in place; returns the change [B, N, N]."""
        change = torch.zeros_like(inside)
        i = (kind == EDITED).nonzero()[:, 0]
        if len(i):
            is_photo = column(self.uniform(len(i)) < 0.5)
            x = torch.where(is_photo, photo[i], picture[i])
            y, change[i] = edit(x, inside[i])
            photo[i] = torch.where(is_photo, y, photo[i])
            picture[i] = torch.where(is_photo, picture[i], y)
        return change

    def cover_pairs(self, kind, picture):
        """Covers some right pairs and look-alikes with bars, in place; returns the coverage [B, N, N]."""
        cover = torch.zeros_like(picture[:, 0])
        i = ((self.uniform(len(kind)) < BAR_SHARE) & (kind <= RIVAL)).nonzero()[:, 0]
        if len(i):
            colour, m = bar(len(i), self.device)
            picture[i] = picture[i] * (1 - m[:, None]) + colour * m[:, None]
            cover[i] = m
        return cover

    def lay_things(self, kind, picture, cover):
        """Covers some right pairs and look-alikes with other parts, in place; adds them to `cover`."""
        i = ((self.uniform(len(kind)) < THING_SHARE) & (kind <= RIVAL)).nonzero()[:, 0]
        if not len(i):
            return
        rows = self.right.pick(self.random_parts(len(i)))
        m = len(i)
        direction, distance = self.uniform(m, 0, 2 * math.pi), self.uniform(m, 20, 70)
        shift_x, shift_y = distance * torch.cos(direction), distance * torch.sin(direction)
        none = torch.zeros(m, device=self.device)
        a, t = affine(self.uniform(m, 0, 2 * math.pi), self.uniform(m, 0.8, 2.0), none, shift_x, shift_y, none + 1)
        lies = (sample_numbers(self.crops.ids[rows], a, t) == crops_.SELF).float()
        colours = sample(self.crops.images[rows].float() / 255, a, t)
        picture[i] = picture[i] * (1 - lies[:, None]) + colours * lies[:, None]
        cover[i] = torch.maximum(cover[i], lies)

    def make_coarse(self, photo, picture):
        """Shows some pictures, and some of their photos, as if the part were small, in place."""
        i = (self.uniform(len(photo)) < COARSE_SHARE).nonzero()[:, 0]
        for k, j in enumerate(i.split(max(1, len(i) // 4 + 1))):
            side = int(torch.randint(40, 100, ()))
            picture[j] = coarse(picture[j], side)
            if k % 2:
                photo[j] = coarse(photo[j], side)

    def shade(self, x):
        """Darkens one side of a line in some pictures, in place."""
        i = (self.uniform(len(x)) < SHADE_SHARE).nonzero()[:, 0]
        if len(i):
            m = len(i)
            axis = torch.linspace(-64, 64, SIDE, device=self.device)
            turn, at = self.uniform(m, 0, 2 * math.pi)[:, None, None], self.uniform(m, -50, 50)[:, None, None]
            distance = axis[None, :, None] * torch.sin(turn) + axis[None, None, :] * torch.cos(turn) - at
            dark = torch.sigmoid(distance / self.uniform(m, 0.5, 8)[:, None, None])
            x[i] = x[i] * (1 - dark * self.uniform(m, 0.2, 0.7)[:, None, None])[:, None]

    def targets(self, kind, inside, seen, labels, change, cover):
        """Targets and weights of pairs and of cells."""
        changed = cell_means(change * inside)
        is_edited, is_rival = kind == EDITED, (kind == RIVAL)[:, None, None]
        is_weak = is_edited & (changed.flatten(1).max(1)[0] < MIN_CHANGE)
        weight = torch.ones(len(kind), device=self.device)
        weight[is_weak] = 0
        share = (cover * inside).flatten(1).sum(1) / inside.flatten(1).sum(1).clamp(min=1)
        weight[share > torch.where(kind == RIVAL, MAX_RIVAL_COVER, MAX_COVER)] = 0
        others = (seen == crops_.OTHER).float()
        covered = cell_means((others + cover).clamp(max=1) * inside) > 0.25
        in_doubt = covered | ((changed > MIN_DOUBT) & (changed < MIN_CHANGE))
        cell_weight = (cell_means(inside) > MIN_INSIDE).float()
        cell_weight = torch.where(in_doubt, torch.zeros_like(cell_weight), cell_weight)
        is_known = (kind == RIGHT) | (is_edited & ~is_weak)
        cell_weight = cell_weight * is_known.float()[:, None, None]
        # Look-alikes also differ outside the outline: a longer part, a lug.
        different = cell_means((labels == crops_.DIFFERENT).float()) > 0.5
        same = cell_means((labels == crops_.SAME).float()) > 0.9
        near = F.max_pool2d(inside[:, None], 13, 1, 6)[:, 0]
        rival_weight = (different | same).float() * (cell_means(near) > MIN_INSIDE).float() * (~covered).float()
        cell_target = torch.where(is_rival, different.float(), (changed > MIN_CHANGE).float())
        cell_weight = torch.where(is_rival, rival_weight, cell_weight)
        return (kind == RIGHT).float(), weight, cell_target, cell_weight

    @torch.no_grad()
    def batch(self, n):
        crops = self.crops
        kind, p, photo_row, picture_row = self.choose(n)
        of_photo, of_picture = self.transforms(n, kind)
        photo = sample(crops.images[photo_row].float() / 255, *of_photo)
        inside = sample(crops.masks[p][:, None].float(), *of_photo, "nearest")[:, 0]
        picture = sample(crops.images[picture_row].float() / 255, *of_picture)
        labels = sample_numbers(crops.labels[picture_row], *of_picture)
        seen = sample_numbers(crops.ids[picture_row], *of_picture)
        is_photo = (crops.ids[photo_row] != crops_.OUTSIDE)[:, None].float()
        photo_valid = (sample(is_photo, *of_photo, "nearest")[:, 0] > 0).float()
        picture_valid = ((seen >= 0) & (seen != crops_.OUTSIDE)).float()
        change = self.edit_pairs(kind, photo, picture, inside)
        cover = self.cover_pairs(kind, picture)
        self.lay_things(kind, picture, cover)
        self.shade(picture)
        self.make_coarse(photo, picture)
        photo, picture = camera(photo), camera(picture)
        is_grey = column(self.uniform(n) < 0.05)
        photo = torch.where(is_grey, photo.mean(1, keepdim=True).expand(-1, 3, -1, -1), photo)
        picture = torch.where(is_grey, picture.mean(1, keepdim=True).expand(-1, 3, -1, -1), picture)
        photo = expose(photo, inside * photo_valid, photo_valid)
        picture = expose(picture, inside * picture_valid, picture_valid)
        x = torch.cat([photo, picture, inside[:, None], picture_valid[:, None]], 1)
        return Batch(x, *self.targets(kind, inside, seen, labels, change, cover))
