"""The `edge` detector in PyTorch: the network of crates/detection's preset, layer by layer, on torch's operations.

Shapes: N images, C channels, L anchors of an image, R ROIs, K keypoints, S side of a heatmap. Modules have the names of
the parameters in our weights.
"""

import math

import torch
import torch.nn.functional as F
import torchvision
from torch import nn
from torchvision.models.detection._utils import BalancedPositiveNegativeSampler, BoxCoder, Matcher
from torchvision.ops import batched_nms, box_iou, clip_boxes_to_image, remove_small_boxes, roi_align
from torchvision.transforms import functional as T

import scene
import weights
from protocol import Work
from r50 import gflop_of

WIDTH, HEIGHT, DIVISIBILITY = 320, 240, 32
BATCH = 4
NUM_KEYPOINTS = 12
# Six parts per picture, more than the two that go through the keypoint head, so that the head's work is the same on
# both sides.
GRID = (3, 2)
SIZES, RATIOS, STRIDES = (24, 40, 70, 120, 200), (0.5, 1.0, 2.0), (4, 8, 16, 32, 64)
BETA = 1 / 9


class Conv(nn.Conv2d):
    """A convolution that keeps the size (at stride 1), with group norm instead of a bias if `norm` is true."""

    def __init__(self, c_in, c_out, kernel, stride=1, norm=False):
        super().__init__(c_in, c_out, kernel, stride, kernel // 2, bias=not norm)
        self.norm = nn.GroupNorm(8, c_out) if norm else None

    def forward(self, x):
        x = super().forward(x)
        return x if self.norm is None else self.norm(x)


class Block(nn.Module):
    def __init__(self, c_in, c_out, stride):
        super().__init__()
        self.conv1 = Conv(c_in, c_out, 3, stride, norm=True)
        self.conv2 = Conv(c_out, c_out, 3, norm=True)
        self.shortcut = Conv(c_in, c_out, 1, stride, norm=True) if c_in != c_out or stride != 1 else None

    def forward(self, x):
        identity = x if self.shortcut is None else self.shortcut(x)
        return F.relu(self.conv2(F.relu(self.conv1(x))) + identity)


class ResNet(nn.Module):
    def __init__(self):
        super().__init__()
        self.stem = nn.Module()
        self.stem.conv1 = Conv(3, 32, 7, 2, norm=True)
        self.res2 = nn.Sequential(Block(32, 32, 1), Block(32, 32, 1))
        self.res3 = nn.Sequential(Block(32, 64, 2), Block(64, 64, 1))
        self.res4 = nn.Sequential(Block(64, 128, 2), Block(128, 128, 1))
        self.res5 = nn.Sequential(Block(128, 256, 2), Block(256, 256, 1))

    def forward(self, x):
        x = F.max_pool2d(F.relu(self.stem.conv1(x)), 3, 2, 1)
        levels = []
        for stage in (self.res2, self.res3, self.res4, self.res5):
            x = stage(x)
            levels.append(x)
        return levels


class Fpn(nn.Module):
    def __init__(self):
        super().__init__()
        for level, channels in zip((2, 3, 4, 5), (32, 64, 128, 256)):
            setattr(self, f"fpn_lateral{level}", Conv(channels, 64, 1))
            setattr(self, f"fpn_output{level}", Conv(64, 64, 3))

    def forward(self, stages):
        merged, levels = None, []
        for level in (5, 4, 3, 2):
            lateral = getattr(self, f"fpn_lateral{level}")(stages[level - 2])
            merged = lateral if merged is None else lateral + F.interpolate(merged, scale_factor=2, mode="nearest")
            levels.insert(0, getattr(self, f"fpn_output{level}")(merged))
        return [*levels, F.max_pool2d(levels[-1], 1, 2)]


class Detector(nn.Module):
    def __init__(self):
        super().__init__()
        self.backbone = nn.Module()
        self.backbone.bottom_up, self.backbone.fpn = ResNet(), Fpn()
        self.proposal_generator = nn.Module()
        head = self.proposal_generator.rpn_head = nn.Module()
        head.conv, head.objectness_logits, head.anchor_deltas = Conv(64, 64, 3), Conv(64, 3, 1), Conv(64, 12, 1)
        self.roi_heads = heads = nn.Module()
        heads.box_head, heads.box_predictor, heads.keypoint_head = nn.Module(), nn.Module(), nn.Module()
        heads.box_head.fc1, heads.box_head.fc2 = nn.Linear(64 * 49, 256), nn.Linear(256, 256)
        heads.box_predictor.cls_score, heads.box_predictor.bbox_pred = nn.Linear(256, 2), nn.Linear(256, 4)
        heads.keypoint_head.conv_fcn = nn.Sequential(*(Conv(64 if i == 0 else 128, 128, 3) for i in range(4)))
        heads.keypoint_head.score_lowres = nn.ConvTranspose2d(128, NUM_KEYPOINTS, 4, 2, 1)
        self.rpn_coder, self.roi_coder = BoxCoder((1.0, 1.0, 1.0, 1.0)), BoxCoder((10.0, 10.0, 5.0, 5.0))
        self.rpn_matcher, self.roi_matcher = Matcher(0.7, 0.3, True), Matcher(0.5, 0.5, False)
        self.rpn_sampler = BalancedPositiveNegativeSampler(128, 0.5)
        self.roi_sampler = BalancedPositiveNegativeSampler(32, 0.25)
        self.anchors_of = {}

    def anchors(self, features):
        """Anchors of each level; cached, because every picture has the same size."""
        key = tuple(feature.shape[-2:] for feature in features)
        if key not in self.anchors_of:
            levels = []
            for (rows, columns), stride, size in zip(key, STRIDES, SIZES):
                widths = torch.tensor([size / math.sqrt(ratio) for ratio in RATIOS])
                halves = torch.stack([widths, widths * torch.tensor(RATIOS)], dim=1) / 2
                y, x = torch.meshgrid(torch.arange(rows) * stride, torch.arange(columns) * stride, indexing="ij")
                centers = torch.stack([x, y], dim=-1).reshape(-1, 1, 2).float()
                levels.append(torch.cat([centers - halves, centers + halves], dim=2).reshape(-1, 4))
            self.anchors_of[key] = levels
        return self.anchors_of[key]

    def predict(self, features):
        """Objectness `[N, L]` and deltas `[N, L, 4]`."""
        head, logits, deltas = self.proposal_generator.rpn_head, [], []
        for feature in features:
            hidden = F.relu(head.conv(feature))
            logits.append(head.objectness_logits(hidden).permute(0, 2, 3, 1).flatten(1))
            deltas.append(head.anchor_deltas(hidden).permute(0, 2, 3, 1).reshape(len(feature), -1, 4))
        return torch.cat(logits, 1), torch.cat(deltas, 1)

    @torch.no_grad()
    def propose(self, anchors, logits, deltas, pre_nms, post_nms):
        counts = [len(level) for level in anchors]
        joined = torch.cat(anchors)
        starts = torch.tensor([0, *counts]).cumsum(0)
        proposals = []
        for image_logits, image_deltas in zip(logits, deltas):
            best = [
                scores.topk(min(pre_nms, len(scores))).indices + start
                for scores, start in zip(image_logits.split(counts), starts)
            ]
            levels = torch.cat([torch.full_like(idxs, level) for level, idxs in enumerate(best)])
            best = torch.cat(best)
            boxes = self.rpn_coder.decode_single(image_deltas[best], joined[best])
            boxes = clip_boxes_to_image(boxes, (HEIGHT, WIDTH))
            kept = remove_small_boxes(boxes, 1e-9)
            boxes, levels, scores = boxes[kept], levels[kept], image_logits[best][kept]
            proposals.append(boxes[batched_nms(boxes, scores, levels, 0.7)[:post_nms]])
        return proposals

    def pool(self, features, boxes, size):
        """Crops `[R, C, size, size]` of the boxes of every image, in their order."""
        rois = torch.cat([F.pad(of_image, (1, 0), value=float(idx)) for idx, of_image in enumerate(boxes)])
        areas = (rois[:, 3] - rois[:, 1]) * (rois[:, 4] - rois[:, 2])
        levels = torch.floor(4 + torch.log2(areas.sqrt() / 112 + 1e-8)).clamp(2, 5).long() - 2
        crops = features[0].new_zeros(len(rois), features[0].shape[1], size, size)
        for level in range(4):
            idxs = torch.where(levels == level)[0]
            if len(idxs) > 0:
                pooled = roi_align(features[level], rois[idxs], size, 1 / STRIDES[level], 2, aligned=True)
                crops = crops.index_put((idxs,), pooled)
        return crops

    def classify(self, features, boxes):
        heads = self.roi_heads
        hidden = F.relu(heads.box_head.fc1(self.pool(features, boxes, 7).flatten(1)))
        hidden = F.relu(heads.box_head.fc2(hidden))
        return heads.box_predictor.cls_score(hidden), heads.box_predictor.bbox_pred(hidden)

    def heatmaps(self, features, boxes):
        """Logits `[R, K, S, S]`."""
        x = self.pool(features, boxes, 14)
        for conv in self.roi_heads.keypoint_head.conv_fcn:
            x = F.relu(conv(x))
        x = self.roi_heads.keypoint_head.score_lowres(x)
        return F.interpolate(x, scale_factor=2, mode="bilinear", align_corners=False)

    def detect(self, images):
        """Boxes, scores and keypoints of one image, best first; class 0 is the part, class 1 the background."""
        features = self.backbone.fpn(self.backbone.bottom_up(images))
        anchors = self.anchors(features)
        logits, deltas = self.predict(features)
        (proposals,) = self.propose(anchors, logits, deltas, 100, 30)
        classes, deltas = self.classify(features, [proposals])
        scores = classes.softmax(1)[:, 0]
        boxes = clip_boxes_to_image(self.roi_coder.decode_single(deltas, proposals), (HEIGHT, WIDTH))
        kept = torch.where(scores > 0.05)[0]
        kept = kept[remove_small_boxes(boxes[kept], 1e-9)]
        kept = kept[torchvision.ops.nms(boxes[kept], scores[kept], 0.5)[:5]]
        boxes = boxes[kept]
        return boxes, scores[kept], local_means(self.heatmaps(features, [boxes]), boxes)

    def losses(self, images, targets):
        features = self.backbone.fpn(self.backbone.bottom_up(images))
        anchors = self.anchors(features)
        logits, deltas = self.predict(features)
        proposals = self.propose(anchors, logits, deltas, 200, 100)
        return self.rpn_losses(torch.cat(anchors), logits, deltas, targets) + self.roi_losses(
            features, proposals, targets
        )

    def rpn_losses(self, anchors, logits, deltas, targets):
        labels, wanted = [], []
        for target in targets:
            matched = self.rpn_matcher(box_iou(target["boxes"], anchors))
            wanted.append(self.rpn_coder.encode_single(target["boxes"][matched.clamp(min=0)], anchors))
            # 1 positive, 0 negative, -1 ignored.
            labels.append(torch.where(matched >= 0, 1, torch.where(matched == Matcher.BELOW_LOW_THRESHOLD, 0, -1)))
        positive, negative = (torch.where(torch.cat(masks))[0] for masks in self.rpn_sampler(labels))
        drawn = torch.cat([positive, negative])
        truth = torch.cat(labels)[drawn].float()
        cls = F.binary_cross_entropy_with_logits(logits.flatten()[drawn], truth)
        predicted, wanted = deltas.reshape(-1, 4)[positive], torch.cat(wanted)[positive]
        return [cls, F.smooth_l1_loss(predicted, wanted, beta=BETA, reduction="sum") / len(drawn)]

    def roi_losses(self, features, proposals, targets):
        boxes, labels, matches = [], [], []
        for of_image, target in zip(proposals, targets):
            candidates = torch.cat([of_image, target["boxes"]])
            matched = self.roi_matcher(box_iou(target["boxes"], candidates))
            positive, negative = self.roi_sampler([(matched >= 0).long()])
            drawn = torch.cat([torch.where(positive[0])[0], torch.where(negative[0])[0]])
            boxes.append(candidates[drawn])
            labels.append(torch.where(matched[drawn] >= 0, 0, 1))
            matches.append(matched[drawn].clamp(min=0))
        classes, deltas = self.classify(features, boxes)
        joined = torch.cat(labels)
        positive = torch.where(joined == 0)[0]
        gt_boxes = torch.cat([target["boxes"][matched] for target, matched in zip(targets, matches)])
        wanted = self.roi_coder.encode_single(gt_boxes[positive], torch.cat(boxes)[positive])
        reg = F.smooth_l1_loss(deltas[positive], wanted, beta=BETA, reduction="sum") / len(joined)
        cls = F.cross_entropy(classes, joined)
        return [cls, reg, self.keypoint_loss(features, boxes, labels, matches, targets)]

    def keypoint_loss(self, features, boxes, labels, matches, targets):
        chosen, cells = [], []
        for of_image, label, matched, target in zip(boxes, labels, matches, targets):
            idxs = torch.where(label == 0)[0]
            idxs = idxs[torch.randperm(len(idxs))[:2]]
            chosen.append(of_image[idxs])
            cells.append(heatmap_cells(target["keypoints"][matched[idxs]], of_image[idxs]))
        self.keypoint_rois = sum(len(of_image) for of_image in chosen)
        logits, cells = self.heatmaps(features, chosen).flatten(0, 1).flatten(1), torch.cat(cells).flatten()
        inside = torch.where(cells >= 0)[0]
        return F.cross_entropy(logits[inside], cells[inside])


def heatmap_cells(keypoints, boxes, size=56):
    """The cell `y·S + x` of each keypoint in its box, `[R, K]`; -1 outside."""
    low, high = boxes[:, None, :2], boxes[:, None, 2:]
    cells = ((keypoints[..., :2] - low) * (size / (high - low))).floor().long()
    cells = torch.where(keypoints[..., :2] == high, size - 1, cells)
    inside = ((cells >= 0) & (cells < size)).all(-1)
    return torch.where(inside, cells[..., 1] * size + cells[..., 0], -1)


def local_means(logits, boxes, radius=3):
    """Keypoints `[R, K, 3]`, x y score: the mean position around each map's peak, weighted by the softmax."""
    size = logits.shape[-1]
    flat = logits.flatten(2)
    peak, best = flat.max(2, keepdim=True)
    heights = (flat - peak).exp()
    cells = torch.arange(size * size)
    rows, columns = cells // size, cells % size
    near = ((rows - best // size).abs() <= radius) & ((columns - best % size).abs() <= radius)
    around = heights * near
    total = around.sum(2)
    x = (around * (columns + 0.5)).sum(2) / total
    y = (around * (rows + 0.5)).sum(2) / total
    low, extent = boxes[:, None, :2], (boxes[:, None, 2:] - boxes[:, None, :2]).clamp(min=1) / size
    places = low + torch.stack([x, y], dim=2) * extent
    return torch.cat([places, 1 / heights.sum(2, keepdim=True)], dim=2)


def grasp(keypoints):
    """Centre and angle of the least-squares line through `[K, 2]` points, from the first to the last."""
    center = keypoints.mean(0)
    (xx, xy), (_, yy) = (keypoints - center).T.matmul(keypoints - center).tolist()
    angle = 0.5 * math.atan2(2 * xy, xx - yy)
    along = keypoints[-1] - keypoints[0]
    if along[0] * math.cos(angle) + along[1] * math.sin(angle) < 0:
        angle += math.pi
    return *center.tolist(), angle


def network_input(picture):
    """Converts bytes `[480, 640, 3]` to the normalised, padded `[1, 3, 256, 320]`."""
    resized = T.resize(torch.from_numpy(picture).permute(2, 0, 1), [HEIGHT, WIDTH], antialias=True)
    normalised = T.normalize(resized.float().div_(255), (0.485, 0.456, 0.406), (0.229, 0.224, 0.225))
    return F.pad(normalised, (0, -WIDTH % DIVISIBILITY, 0, -HEIGHT % DIVISIBILITY))[None]


def version():
    return f"torch {torch.__version__.split('+')[0]}, torchvision {torchvision.__version__.split('+')[0]}"


def detector(path, layout):
    return weights.load(Detector(), weights.read(path)).to(memory_format=layout)


def detection(path, layout):
    model = detector(path, layout).eval()
    picture = scene.picture()

    def run():
        with torch.inference_mode():
            found = model.detect(network_input(picture).to(memory_format=layout))
            boxes, scores, keypoints = found
            scale = scene.WIDTH / WIDTH
            return boxes, scores, keypoints, [grasp(of_box[:, :2] * scale) for of_box in keypoints]

    found = []
    gflop = gflop_of(lambda: found.extend(run()))
    boxes, scores, keypoints, _ = found
    facts = {
        "boxes": len(boxes),
        "mean_score": float(scores.mean()),
        "mean_keypoint_score": float(keypoints[..., 2].mean()),
    }
    return Work(run, facts, gflop, version())


def training_step(path, layout):
    model = detector(path, layout).train()
    parameters = list(model.parameters())
    optimizer = torch.optim.AdamW(parameters, lr=1e-5, weight_decay=1e-4, fused=True)
    scale = WIDTH / scene.WIDTH
    boxes = scene.boxes(*GRID)
    marks = scene.keypoints(boxes, NUM_KEYPOINTS)
    target = {"boxes": torch.from_numpy(boxes * scale), "keypoints": torch.from_numpy(marks * scale)}
    # Prepared beforehand, because our trainer gets them from another thread.
    images = torch.cat([network_input(scene.picture(number)) for number in range(BATCH)])
    images = images.to(memory_format=layout)

    def run():
        optimizer.zero_grad(set_to_none=True)
        sum(model.losses(images, [target] * BATCH)).backward()
        torch.nn.utils.clip_grad_norm_(parameters, 10.0)
        optimizer.step()

    gflop = gflop_of(run)
    return Work(run, {"head_rois": model.keypoint_rois}, gflop, version())
