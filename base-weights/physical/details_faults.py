"""Random changes of pictures on the device: edits of one place, bars across the part, camera faults.

Legend: B pairs, M of these pairs, N = 128 pixels per side of the network's input. Colours [., 3, N, N] from 0 to 1.
"""

import math

import torch
import torch.nn.functional as F

SIDE = 128  # N
CELL = 8  # pixels of a cell's side
EDITS = range(5)  # smoothed, moved from far (twice as often), moved from near, from another part
SMOOTHED, NEAR, FOREIGN = 0, 3, 4


def uniform(n, device, lo=0.0, hi=1.0):
    return torch.rand(n, device=device) * (hi - lo) + lo


def column(v):
    """Reshapes [n] to [n, 1, 1, 1]."""
    return v[:, None, None, None]


def pixel_axes(lo, hi, device):
    """Rows and columns [N, N], from lo to hi."""
    axis = torch.linspace(lo, hi, SIDE, device=device)
    return torch.meshgrid(axis, axis, indexing="ij")


def blob(cx, cy, radius):
    """Soft ellipses or rectangles [M, N, N] about (cx, cy), in pixels."""
    n, device = len(cx), cx.device
    yy, xx = pixel_axes(0, SIDE - 1, device)
    turn = uniform(n, device, 0, math.pi)
    ratio = uniform(n, device, 0.5, 1.0)[:, None, None]
    dx, dy = xx[None] - cx[:, None, None], yy[None] - cy[:, None, None]
    cos, sin = torch.cos(turn)[:, None, None], torch.sin(turn)[:, None, None]
    u = dx * cos + dy * sin
    v = -dx * sin + dy * cos
    # One kind of shape for the whole batch.
    if torch.rand(()) < 0.4:
        distance = torch.maximum(u.abs(), v.abs() / ratio)
    else:
        distance = torch.sqrt(u * u + (v / ratio) ** 2)
    return torch.sigmoid((radius[:, None, None] - distance) / uniform(n, device, 0.5, 2.5)[:, None, None])


def edit_place(x, inside):
    """A random place (cx, cy) in the outline for an edit, more often where there are edges."""
    slope = F.pad((x.mean(1)[:, :, 1:] - x.mean(1)[:, :, :-1]).abs(), (0, 1))
    energy = F.avg_pool2d((slope * inside)[:, None], CELL)[:, 0].flatten(1)
    share = F.avg_pool2d(inside[:, None], CELL)[:, 0].flatten(1)
    weight = (energy / energy.sum(1, keepdim=True).clamp(min=1e-6) + 0.4 / 256) * (share > 0.3) + 1e-9
    cell = torch.multinomial(weight, 1)[:, 0]
    cy = (cell // 16) * CELL + uniform(len(x), x.device, 0, CELL)
    cx = (cell % 16) * CELL + uniform(len(x), x.device, 0, CELL)
    return cx, cy


def smoothed(x):
    for _ in range(2):
        x = F.avg_pool2d(F.pad(x, (4, 4, 4, 4), mode="replicate"), 9, 2)
        x = F.interpolate(x, size=(SIDE, SIDE), mode="bilinear", align_corners=False)
    return x


def edit(x, inside):
    """Changes one place of each picture; returns the pictures and the change of each pixel [M, N, N]."""
    n, device = len(x), x.device
    cx, cy = edit_place(x, inside)
    m = blob(cx, cy, uniform(n, device, 5, 20))[:, None]
    how = torch.randint(len(EDITS), (n,), device=device)
    near, far = uniform(n, device, 4.5, 9), uniform(n, device, 12, 40)
    distance = torch.where(how == NEAR, near, far)
    angle = uniform(n, device, 0, 2 * math.pi)
    shift = torch.stack([distance * torch.cos(angle), distance * torch.sin(angle)], -1)
    identity = torch.eye(2, device=device).repeat(n, 1, 1)
    affine = torch.cat([identity, shift[:, :, None] / (SIDE / 2)], 2)
    grid = F.affine_grid(affine, (n, 1, SIDE, SIDE), align_corners=False)
    moved = F.grid_sample(x, grid, padding_mode="reflection", align_corners=False)
    perm = torch.randperm(n, device=device)
    foreign = x[perm] * column(x.mean((1, 2, 3)) / x[perm].mean((1, 2, 3)).clamp(min=0.02))
    fill = torch.where(column(how == FOREIGN), foreign, moved)
    fill = torch.where(column(how == SMOOTHED), smoothed(x), fill)
    y = x * (1 - m) + fill * m
    change = (y - x).abs().mean(1) / (x.mean((1, 2, 3))[:, None, None] + 0.05)
    return y, change


def bar(n, device):
    """Round bars across the picture: their colours [M, 3, N, N] and their coverage [M, N, N]."""
    yy, xx = pixel_axes(-SIDE / 2, SIDE / 2 - 1, device)
    turn = uniform(n, device, 0, math.pi)
    offset = uniform(n, device, -45, 45)[:, None, None]
    half = uniform(n, device, 3, 14)[:, None, None]
    cos, sin = torch.cos(turn)[:, None, None], torch.sin(turn)[:, None, None]
    distance = (xx[None] * cos + yy[None] * sin - offset).abs()
    cover = torch.sigmoid((half - distance) / 0.8)
    shade = torch.sqrt((1 - (distance / half).clamp(max=1) ** 2).clamp(min=0)) * 0.6 + 0.4
    colour = uniform(3 * n, device, 0.02, 0.9).view(n, 3, 1, 1) * shade[:, None]
    return colour, cover


def camera(x):
    """Changes contrast, exposure, white balance and the gradient of light, and adds blur and noise."""
    n, device = len(x), x.device
    y = x.clamp(1e-4, 1)
    y = y ** column(torch.exp(torch.randn(n, device=device) * 0.25))
    y = y * column(torch.exp(torch.randn(n, device=device) * 0.35))
    y = y * torch.exp(torch.randn(n, 3, device=device) * 0.07)[:, :, None, None]
    yy, xx = pixel_axes(-1, 1, device)
    slope = torch.randn(n, 2, device=device) * 0.15
    y = y * torch.exp(slope[:, 0, None, None] * xx + slope[:, 1, None, None] * yy)[:, None]
    y = y.clamp(0, 1)
    is_blurred = uniform(n, device) < 0.3
    y = torch.where(column(is_blurred), F.avg_pool2d(F.pad(y, (1, 1, 1, 1), mode="replicate"), 3, 1), y)
    noise = torch.randn_like(y)
    return (y + noise * column(uniform(n, device, 0, 0.02))).clamp(0, 1)
