"""The packed crops of pack_train.py on the device, with labels of the pixels of look-alikes.

Legend: n crops, P parts, S = 160 pixels of a crop's side. Colours are RGB.
"""

from concurrent.futures import ThreadPoolExecutor

import cv2
import numpy as np
import torch
import torch.nn.functional as F

SIDE = 160  # S
DEMO, RIGHT, RIVAL, ELSEWHERE = range(4)  # kinds, as in pack_train.py
TABLE, SELF, OTHER, OUTSIDE = range(4)  # ids, as in pack_train.py
SAME, DIFFERENT, UNKNOWN = range(3)  # labels of pixels of look-alikes
HELD_OUT_EVERY = 10  # every tenth part is not used for training


def expose(x, inside, valid):
    """Colours [n, 3, h, w], scaled to one exposure: their mean in the outline is about 0.5; 0 where not valid ([n, h, w])."""
    mean = (x.mean(1) * inside).flatten(1).sum(1) / inside.flatten(1).sum(1).clamp(min=1)
    gain = 0.5 / (mean + 0.02)
    return ((x + 0.02) * gain[:, None, None, None]).clamp(max=2.0) * valid[:, None]


class Rows:
    """The crops of each part that meet a condition, and the random choice of one."""

    def __init__(self, selected, parts, num_parts, device):
        rows = [np.nonzero(selected & (parts == p))[0] for p in range(num_parts)]
        count = np.array([len(r) for r in rows])
        table = np.zeros((num_parts, max(1, count.max())), int)
        for p, r in enumerate(rows):
            table[p, : len(r)] = r
        self.table = torch.from_numpy(table).to(device)  # [P, most crops of a part]
        self.count = torch.from_numpy(count).to(device)  # [P]

    def pick(self, p):
        """A random crop of each part of `p` ([B]); any crop for a part without one."""
        k = (torch.rand(len(p), device=p.device) * self.count[p]).long()
        return self.table[p, k.clamp(max=self.table.shape[1] - 1)]


class Crops:
    """All crops: images [n, 3, S, S], ids and labels [n, S, S], masks [P, S, S] on the device; other arrays numpy, [n]."""

    def __init__(self, paths, device):
        self.device = device
        images, ids, masks = [], [], []
        parts, kinds, visible, what, pictures = [], [], [], [], []
        num_pictures = 0
        for path in paths:
            z = np.load(path, allow_pickle=False)
            images += decoded(z["images"], z["images_at"], cv2.IMREAD_COLOR_RGB)
            ids += decoded(z["ids"], z["ids_at"], cv2.IMREAD_GRAYSCALE)
            parts += list(z["parts"] + len(masks))
            kinds += list(z["kinds"])
            visible += list(z["visible"])
            # Removes the prefix of look-alikes that the program found.
            what += [str(v).replace("found ", "") for v in z["what"]]
            pictures += list(z["pictures"] + num_pictures)
            num_pictures += z["pictures"].max() + 1
            masks += [np.unpackbits(m).reshape(SIDE, SIDE) for m in z["masks"]]
        self.images = torch.from_numpy(np.stack(images)).permute(0, 3, 1, 2).contiguous().to(device)
        self.ids = torch.from_numpy(np.stack(ids)).to(device)
        self.masks = torch.from_numpy(np.stack(masks)).to(device)
        self.parts, self.kinds, self.visible = np.array(parts), np.array(kinds), np.array(visible)
        self.what, self.pictures = np.array(what), np.array(pictures)
        self.num_parts = len(masks)
        self.held_out = np.arange(self.num_parts) % HELD_OUT_EVERY == HELD_OUT_EVERY - 1
        self.labels = self.label_rivals()

    def rows(self, selected):
        return Rows(selected, self.parts, self.num_parts, self.device)

    def label_rivals(self):
        """Labels [n, S, S] of pixels: where a look-alike differs from the part in the same picture.

        A picture shows the part twice: its two crops show how much light and view change by themselves.
        """
        labels = torch.full((len(self.parts), SIDE, SIDE), UNKNOWN, dtype=torch.uint8, device=self.device)
        rights = {}
        clear = (self.kinds == RIGHT) & (self.visible > 0.97) & (self.what != "found")
        for i in np.nonzero(clear)[0]:
            rights.setdefault(self.pictures[i], []).append(i)
        num_labelled = 0
        for i in np.nonzero(self.kinds == RIVAL)[0]:
            both = rights.get(self.pictures[i], [])[:2]
            if len(both) == 2:
                labels[i] = self.label_rival(i, both)
                num_labelled += 1
        share = float((labels == DIFFERENT).float().sum() / max(1, num_labelled) / SIDE / SIDE)
        print(f"{num_labelled} labelled look-alikes, {share:.4f} of their pixels differ", flush=True)
        return labels

    def label_rival(self, i, rights):
        rows = torch.tensor([i, *rights], device=self.device)
        inside = self.masks[int(self.parts[i])][None].float().expand(len(rows), -1, -1)
        x = expose(self.images[rows].float() / 255, inside, torch.ones_like(inside))
        x = F.avg_pool2d(x, 7, 1, 3)

        def difference(a, b):
            return F.avg_pool2d((a - b).abs().mean(0, keepdim=True)[None], 5, 1, 2)[0, 0]

        between_rights = F.max_pool2d(difference(x[1], x[2])[None, None], 9, 1, 4)[0, 0]
        to_rival = torch.minimum(difference(x[0], x[1]), difference(x[0], x[2]))
        same_or_unknown = torch.where(to_rival < between_rights + 0.02, SAME, UNKNOWN)
        label = torch.where(to_rival > 2 * between_rights + 0.06, DIFFERENT, same_or_unknown)
        own = (self.ids[rows] != OTHER).all(0) & (self.ids[rows] != OUTSIDE).all(0)
        return torch.where(own, label, UNKNOWN).to(torch.uint8)


def decoded(joined, starts, mode):
    """Decodes the picture files that are concatenated in `joined`."""

    def decode(k):
        return cv2.imdecode(joined[starts[k] : starts[k + 1]], mode)

    with ThreadPoolExecutor(16) as pool:
        return list(pool.map(decode, range(len(starts) - 1)))
