"""A product of square matrices, which measures the machine."""

import torch

from protocol import Work

SIDE = 2048


def product():
    a, b = torch.rand(SIDE, SIDE), torch.rand(SIDE, SIDE)
    return Work(lambda: torch.mm(a, b), {}, 2e-9 * SIDE**3, f"torch {torch.__version__.split('+')[0]}")
