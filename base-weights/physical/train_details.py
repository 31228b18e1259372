"""Trains the details network on packs of pack_train.py. Usage:

    train_details.py OUT.pt PACK.npz... [--init FILE.pt] [--minutes 8] [--max-steps N] [--batch 256] [--lr 2e-3]
        [--seed 1]

Runs on CUDA, or on the CPU without CUDA. It ends after the minutes or the steps, whichever is earlier, and the learning
rate falls to nearly 0 by then. OUT.pt gets the mean weights of the last steps, from which `--init` starts and which
details_net.py exports.

Printed: the areas under the ROC curve of right against wrong poses of the held-out parts, in total, by the difference of
the look-alikes, and within each part (mean). The held-out parts are used for nothing else.
"""

import argparse
import math
import time

import numpy as np
import torch
import torch.nn.functional as F
from torch import nn

import details_crops as crops_
from details_crops import Crops, expose
from details_faults import SIDE
from details_net import Siam
from details_pairs import Pairs

CELLS_LOSS = 0.5  # weight of the cells' loss
DIFFERENT_WEIGHT = 4.0  # weight of cells that differ, which are few
WEIGHT_DECAY = 0.02
MAX_NORM = 5.0  # maximum norm of the gradient
WARM_UP_STEPS = 300
MIN_LR = 1e-5
MEAN_DECAY = 0.998  # decay of the mean weights, per step
REPORT_SECS = 25
CPU_OR_CUDA = "cuda" if torch.cuda.is_available() else "cpu"


def auc(right, wrong):
    """The area under the ROC curve; NaN if one kind is missing."""
    if not len(right) or not len(wrong):
        return float("nan")
    ranks = np.concatenate([right, wrong]).argsort().argsort()[: len(right)]
    return (ranks.sum() - len(right) * (len(right) - 1) / 2) / (len(right) * len(wrong))


@torch.no_grad()
def answers(net, crops, demo, rows):
    """The network's answers for crops against the demonstrations of their parts, without random changes."""
    margin = (crops_.SIDE - SIDE) // 2

    def middle(x):
        return x[..., margin : margin + SIDE, margin : margin + SIDE]

    out = []
    for k in range(0, len(rows), 256):
        r = torch.from_numpy(rows[k : k + 256]).to(crops.device)
        p = torch.from_numpy(crops.parts[rows[k : k + 256]]).to(crops.device)
        d = demo.table[p, 0]
        photo, picture = middle(crops.images[d]).float() / 255, middle(crops.images[r]).float() / 255
        inside = middle(crops.masks[p]).float()
        photo_valid = (middle(crops.ids[d]) != crops_.OUTSIDE).float()
        picture_valid = (middle(crops.ids[r]) != crops_.OUTSIDE).float()
        photo = expose(photo, inside * photo_valid, photo_valid)
        picture = expose(picture, inside * picture_valid, picture_valid)
        x = torch.cat([photo, picture, inside[:, None], picture_valid[:, None]], 1)
        out.append(net(x)[0].float().cpu().numpy())
    return np.concatenate(out)


def evaluate(net, crops, demo):
    """The areas under the ROC curve of the held-out parts, as a line of text."""
    is_clear = (crops.visible > 0.6) | (crops.kinds == crops_.ELSEWHERE)
    rows = np.nonzero((crops.kinds != crops_.DEMO) & crops.held_out[crops.parts] & is_clear)[0]
    if not len(rows):
        return "no part is held out"
    scores = answers(net, crops, demo, rows)
    kinds, what, parts = crops.kinds[rows], crops.what[rows], crops.parts[rows]
    right, rival = kinds == crops_.RIGHT, kinds == crops_.RIVAL
    is_print = np.array(["print" in v for v in what])
    groups = {
        "all": rival,
        "else": kinds == crops_.ELSEWHERE,
        "mirror": what == "mirror image",
        "longer": np.char.endswith(what, "longer"),
        "print": is_print,
        "moved": np.char.endswith(what, " moved") & ~is_print,
        "missing": np.char.endswith(what, " missing") & ~is_print,
        "added": np.char.endswith(what, "added") & ~is_print,
    }
    out = [f"{name} {auc(scores[right], scores[group & ~right]):.3f}" for name, group in groups.items()]
    within = []
    for p in np.unique(parts):
        within.append(auc(scores[right & (parts == p)], scores[rival & (parts == p)]))
    return " ".join([*out, f"within {np.nanmean(within):.3f}"])


def losses(answer, cells, batch):
    """The losses of the answer and of the cells."""
    of_pairs = F.binary_cross_entropy_with_logits(answer.float(), batch.target, reduction="none")
    of_cells = F.binary_cross_entropy_with_logits(cells.float(), batch.cell_target, reduction="none")
    cell_weight = batch.cell_weight * torch.where(batch.cell_target > 0, DIFFERENT_WEIGHT, 1.0)
    mean_of_cells = (of_cells * cell_weight).sum() / cell_weight.sum().clamp(min=1)
    return (of_pairs * batch.weight).mean(), mean_of_cells


@torch.no_grad()
def follow(mean, net, step):
    """Moves the mean weights towards the network's weights, faster in the first steps."""
    decay = min(MEAN_DECAY, (1 + step) / (10 + step))
    for m, n in zip(mean.parameters(), net.parameters()):
        m.lerp_(n, 1 - decay)
    for m, n in zip(mean.buffers(), net.buffers()):
        if m.dtype == torch.long:
            m.copy_(n)
        else:
            m.lerp_(n, 1 - decay)


def train(crops, args):
    """Trains and returns the mean of the network's weights."""
    device = crops.device
    is_cuda = device == "cuda"
    if is_cuda:
        torch.backends.cudnn.benchmark = True
        torch.backends.cuda.matmul.allow_tf32 = True
        torch.backends.cudnn.allow_tf32 = True
    pairs = Pairs(crops)
    net = Siam().to(device).to(memory_format=torch.channels_last)
    if args.init:
        net.load_state_dict(torch.load(args.init, map_location=device))
    mean = Siam().to(device)
    mean.load_state_dict(net.state_dict())
    mean.eval()
    print(f"{sum(p.numel() for p in net.parameters())} parameters", flush=True)
    optimizer = torch.optim.AdamW(net.parameters(), lr=args.lr, weight_decay=WEIGHT_DECAY)
    start = last = time.time()
    step, recent = 0, []
    while True:
        done = max((time.time() - start) / (60 * args.minutes), step / args.max_steps)
        if done >= 1:
            break
        for g in optimizer.param_groups:
            warm_up = min(1, step / WARM_UP_STEPS + 0.01)
            g["lr"] = args.lr * warm_up * (0.5 + 0.5 * math.cos(math.pi * done)) + MIN_LR
        batch = pairs.batch(args.batch)
        with torch.autocast(device, dtype=torch.bfloat16, enabled=is_cuda):
            answer, cells = net(batch.x.contiguous(memory_format=torch.channels_last))
        of_pairs, of_cells = losses(answer, cells, batch)
        loss = of_pairs + CELLS_LOSS * of_cells
        optimizer.zero_grad(set_to_none=True)
        loss.backward()
        nn.utils.clip_grad_norm_(net.parameters(), MAX_NORM)
        optimizer.step()
        step += 1
        follow(mean, net, step)
        if step % 20 == 0:  # not in each step, because reading a number waits for the device
            recent = [*recent, (of_pairs.item(), of_cells.item())][-20:]
        if time.time() - last > REPORT_SECS or step == 50:
            last = time.time()
            loss_text = "loss {:.4f} cells {:.4f}".format(*np.mean(recent, 0)) if recent else "loss -"
            about = f"{last - start:.0f} s, step {step}, {loss_text}"
            print(f"{about} | {evaluate(mean, crops, pairs.demo)}", flush=True)
    print(f"final, step {step} | {evaluate(mean, crops, pairs.demo)}", flush=True)
    return {k: v.cpu() for k, v in mean.state_dict().items()}


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("out")
    args.add_argument("packs", nargs="+")
    args.add_argument("--init", help="weights to start from")
    args.add_argument("--minutes", type=float, default=8)
    args.add_argument("--max-steps", type=int, default=10**9)
    args.add_argument("--batch", type=int, default=256)
    args.add_argument("--lr", type=float, default=2e-3, help="maximum learning rate")
    args.add_argument("--seed", type=int, default=1)
    args = args.parse_args()
    torch.manual_seed(args.seed)
    crops = Crops(args.packs, CPU_OR_CUDA)
    counts = [(crops.kinds == k).sum() for k in (crops_.RIGHT, crops_.RIVAL, crops_.ELSEWHERE)]
    print("{} parts, {} right poses, {} look-alikes, {} elsewhere".format(crops.num_parts, *counts), flush=True)
    torch.save(train(crops, args), args.out)


if __name__ == "__main__":
    main()
