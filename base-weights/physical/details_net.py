"""The network of the details, and its export for crates/shape. Usage: details_net.py FILE.pt... OUT.safetensors [--parity]

Writes the weights of train_details.py in half precision, with batch norms folded in; if several FILE.pt are given,
writes the mean of their weights, which is valid if one training started from the weights of the other. `--parity` prints
the log-odds that the test of crates/shape/src/details/network.rs expects: of two generated inputs, with the weights in
half and the sums in double precision.

Legend: B pairs, N = 128 pixels per side of the input, C = 16 cells per side. The input [B, 8, N, N] is photo RGB, picture
RGB, in the outline (0 or 1), picture valid (0 or 1). The answer [B] has the log-odds that the picture shows the part;
the cells [B, C, C] have the log-odds that photo and picture differ there.
"""

import argparse

import torch
import torch.nn.functional as F
from torch import nn

CELL = 8  # pixels of a cell's side
MIN_INSIDE = 0.3  # minimum fraction of a counted cell inside the outline
TOWER_CHANNELS = (16, 32, 24)
COMPARED_CHANNELS = (48, 48, 64, 64)
NUM_HIDDEN = 64
NO_CELL = -20.0  # log-odds of cells outside of the outline
PARITY_SEEDS = (13, 500)


class ConvNorm(nn.Module):
    """3 x 3 convolution, batch norm, rectifier."""

    def __init__(self, inputs, outputs, stride=1):
        super().__init__()
        self.c = nn.Conv2d(inputs, outputs, 3, stride, 1, bias=False)
        self.b = nn.BatchNorm2d(outputs)

    def forward(self, x):
        return F.relu(self.b(self.c(x)))


def cells_inside(inside):
    """Whether cells are in the outline: [B, C, C] from [B, N, N]."""
    return F.avg_pool2d(inside[:, None], CELL)[:, 0] > MIN_INSIDE


def pooled(x, cells, inside):
    """Inputs of the answer: the mean and the maximum of each channel; of the cells, a quarter of the largest log-odds
    and the mean probability.
    """
    m = cells_inside(inside)
    largest = torch.where(m, cells, torch.full_like(cells, NO_CELL)).flatten(1).amax(1)
    count = m.flatten(1).sum(1).clamp(min=1)
    mean = (torch.sigmoid(cells) * m).flatten(1).sum(1) / count
    return torch.cat([x.mean((2, 3)), x.amax((2, 3)), largest[:, None] / 4, mean[:, None]], 1)


class Head(nn.Module):
    """The answers: of each cell from `cell_channels`, of the pair from `channels` of the last layer and the cells."""

    def __init__(self, channels, cell_channels):
        super().__init__()
        self.cell = nn.Conv2d(cell_channels, 1, 1)
        self.h = nn.Linear(2 * channels + 2, NUM_HIDDEN)
        self.o = nn.Linear(NUM_HIDDEN, 1)

    def cells(self, x):
        return self.cell(x)[:, 0]

    def forward(self, x, cells, inside):
        return self.o(F.relu(self.h(pooled(x, cells, inside))))[:, 0]


class Siam(nn.Module):
    """Two towers with the same weights, convolutions of their outputs and of the difference, and the head."""

    def __init__(self):
        super().__init__()
        t, c = TOWER_CHANNELS, COMPARED_CHANNELS
        self.t1, self.t2, self.t3 = ConvNorm(5, t[0], 2), ConvNorm(t[0], t[1], 2), ConvNorm(t[1], t[2])
        self.c1, self.c2 = ConvNorm(3 * t[2], c[0], 2), ConvNorm(c[0], c[1])
        self.c3, self.c4 = ConvNorm(c[1], c[2], 2), ConvNorm(c[2], c[3])
        self.head = Head(c[3], c[1])

    def tower(self, x):
        return self.t3(self.t2(self.t1(x)))

    def forward(self, x):
        """The answer [B] and the cells [B, C, C]."""
        inside, about = x[:, 6], x[:, 6:8]
        # Photos and pictures are in one batch, so the batch norms have the same statistics for both.
        both = torch.cat([torch.cat([x[:, 0:3], about], 1), torch.cat([x[:, 3:6], about], 1)])
        a, b = self.tower(both).split(len(x))
        x = self.c2(self.c1(torch.cat([(a - b).abs(), a, b], 1)))
        cells = self.head.cells(x)
        return self.head(self.c4(self.c3(x)), cells, inside), cells


def folded(state):
    """The weights by their names in the safetensors file, batch norms folded in, in half precision."""
    out = {}
    for name, layers in (("tower", ("t1", "t2", "t3")), ("compared", ("c1", "c2", "c3", "c4"))):
        for i, layer in enumerate(layers):
            gain = state[f"{layer}.b.weight"] / torch.sqrt(state[f"{layer}.b.running_var"] + 1e-5)
            out[f"{name}.{i}.weight"] = state[f"{layer}.c.weight"] * gain[:, None, None, None]
            out[f"{name}.{i}.bias"] = state[f"{layer}.b.bias"] - state[f"{layer}.b.running_mean"] * gain
    out["cells.weight"] = state["head.cell.weight"].reshape(1, -1)
    out["cells.bias"] = state["head.cell.bias"]
    for name, layer in (("hidden", "head.h"), ("answer", "head.o")):
        out[f"{name}.weight"] = state[f"{layer}.weight"]
        out[f"{name}.bias"] = state[f"{layer}.bias"]
    return {k: v.half().contiguous() for k, v in out.items()}


def parity_input(seed):
    """The input of the Rust test, [1, 8, N, N]."""
    i = torch.arange(128 * 128 * 8)
    x = ((i * 7919 + seed * (i // 512)) % 1000).float() / 1000
    x = x.double().reshape(1, 128, 128, 8).permute(0, 3, 1, 2).clone()
    x[:, 6:] = (x[:, 6:] > 0.3).double()
    return x


def folded_answer(weights, x):
    """The answer of the exported weights, in double precision."""
    w = {k: v.double() for k, v in weights.items()}

    def conv(name, x, stride):
        return F.relu(F.conv2d(x, w[f"{name}.weight"], w[f"{name}.bias"], stride, 1))

    def tower(colours):
        y = conv("tower.0", torch.cat([colours, x[:, 6:]], 1), 2)
        return conv("tower.2", conv("tower.1", y, 2), 1)

    a, b = tower(x[:, :3]), tower(x[:, 3:6])
    y = conv("compared.1", conv("compared.0", torch.cat([(a - b).abs(), a, b], 1), 2), 1)
    cells = F.conv2d(y, w["cells.weight"][:, :, None, None], w["cells.bias"])[:, 0]
    y = conv("compared.3", conv("compared.2", y, 2), 1)
    hidden = F.relu(F.linear(pooled(y, cells, x[:, 6]), w["hidden.weight"], w["hidden.bias"]))
    return F.linear(hidden, w["answer.weight"], w["answer.bias"]).item()


def main():
    from safetensors.torch import save_file  # the training does not need it

    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("weights", nargs="+")
    args.add_argument("out")
    args.add_argument("--parity", action="store_true", help="print the values of the Rust test")
    args = args.parse_args()
    states = [torch.load(path, map_location="cpu") for path in args.weights]
    weights = folded({k: sum(state[k] for state in states) / len(states) for k in states[0]})
    save_file(weights, args.out)
    if args.parity:
        for seed in PARITY_SEEDS:
            print(f"seed {seed}: {folded_answer(weights, parity_input(seed)):.6f}")


if __name__ == "__main__":
    main()
