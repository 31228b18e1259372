"""Makes the golden files in this folder: torchvision's own outputs for small random networks of all three kinds.

    python export.py            the three small ones, with expected outputs
    python export.py --whole D  a whole R50 keypoint network into folder D, for the test that compares it when torch
                                is present; exact.safetensors there holds its gradients computed in double precision

The three small ones were made with torch 2.7.1, torchvision 0.22.1, Pillow 11.1.0 and numpy 2.2.6; the whole one is
made with the installed versions. The weights have torchvision's names. Losses have this project's names, detections
are in pixels of the image, targets in pixels of the resized image.
The samplers keep all positive and negative anchors and proposals: nothing is random.
"""

import argparse
import json
import pathlib
import struct

import numpy as np
import torch
import torchvision
from PIL import Image, ImageDraw
from torchvision.models.detection import FasterRCNN, KeypointRCNN, MaskRCNN, backbone_utils, keypoint_rcnn, mask_rcnn
from torchvision.models.detection._utils import BalancedPositiveNegativeSampler, overwrite_eps
from torchvision.models.detection.faster_rcnn import FastRCNNPredictor, TwoMLPHead
from torchvision.models.resnet import Bottleneck, ResNet
from torchvision.ops.misc import FrozenBatchNorm2d

HERE = pathlib.Path(__file__).parent
IMAGE = HERE.parent / "detectron2" / "input.png"
CLASSES, KEYPOINTS, CHANNELS, FC = 2, 5, 16, 32
LOSSES = {
    "loss_objectness": "loss_rpn_cls",
    "loss_rpn_box_reg": "loss_rpn_loc",
    "loss_classifier": "loss_cls",
}
GRADIENTS = [
    "backbone.body.layer3.0.conv2.weight",
    "backbone.fpn.inner_blocks.1.0.weight",
    "backbone.fpn.layer_blocks.0.0.weight",
    "rpn.head.conv.0.0.weight",
    "roi_heads.box_head.fc6.bias",
    "roi_heads.box_predictor.bbox_pred.weight",
    "roi_heads.keypoint_head.0.weight",
    "roi_heads.keypoint_predictor.kps_score_lowres.weight",
    "roi_heads.mask_head.0.0.weight",
    "roi_heads.mask_predictor.mask_fcn_logits.weight",
]


class NarrowResNet(ResNet):
    """ResNet with a sixteenth of its channels; the stem has a quarter."""

    def _make_layer(self, block, planes, blocks, stride=1, dilate=False):
        if planes == 64:
            self.inplanes = 16
            self.conv1 = torch.nn.Conv2d(3, 16, 7, 2, 3, bias=False)
            self.bn1 = self._norm_layer(16)
        return super()._make_layer(block, planes // 16, blocks, stride, dilate)


def save_file(tensors, path):
    """Writes a safetensors file of float, integer and byte tensors."""
    names = {torch.float32: "F32", torch.int64: "I64", torch.uint8: "U8"}
    # Wider elements first, so that all are aligned.
    ordered = sorted(tensors.items(), key=lambda item: -item[1].element_size())
    header, data = {}, []
    offset = 0
    for name, tensor in ordered:
        values = tensor.contiguous().numpy().tobytes()
        place = [offset, offset + len(values)]
        header[name] = {"dtype": names[tensor.dtype], "shape": list(tensor.shape), "data_offsets": place}
        data.append(values)
        offset += len(values)
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 8)
    path.write_bytes(struct.pack("<Q", len(text)) + text + b"".join(data))


def build(kind, narrow, limits):
    if narrow:
        body = NarrowResNet(Bottleneck, [1, 1, 1, 1], norm_layer=FrozenBatchNorm2d)
        # The backbone does not use this layer, whose width does not fit the narrow ones.
        body.fc = torch.nn.Identity()
        layers = ["layer4", "layer3", "layer2"]
        for name, parameter in body.named_parameters():
            parameter.requires_grad_(any(name.startswith(layer) for layer in layers))
        returned = {f"layer{k}": str(k - 1) for k in (1, 2, 3, 4)}
        backbone = backbone_utils.BackboneWithFPN(body, returned, [16, 32, 64, 128], CHANNELS)
    else:
        backbone = backbone_utils.resnet_fpn_backbone(
            backbone_name="resnet50", weights=None, norm_layer=FrozenBatchNorm2d, trainable_layers=3
        )
    heads = {}
    if narrow:
        heads["box_head"] = TwoMLPHead(CHANNELS * 49, FC)
        classes = 2 if kind == "keypoint" else CLASSES + 1
        heads["box_predictor"] = FastRCNNPredictor(FC, classes)
        if kind == "keypoint":
            heads["keypoint_head"] = keypoint_rcnn.KeypointRCNNHeads(CHANNELS, (CHANNELS,) * 8)
            heads["keypoint_predictor"] = keypoint_rcnn.KeypointRCNNPredictor(CHANNELS, KEYPOINTS)
        if kind == "mask":
            heads["mask_head"] = mask_rcnn.MaskRCNNHeads(CHANNELS, (CHANNELS,) * 4, 1)
            heads["mask_predictor"] = mask_rcnn.MaskRCNNPredictor(CHANNELS, CHANNELS, classes)
        model = {"faster": FasterRCNN, "keypoint": KeypointRCNN, "mask": MaskRCNN}[kind](backbone, **heads, **limits)
    else:
        model = KeypointRCNN(backbone, num_classes=2, **limits)
    # As for the released COCO weights.
    overwrite_eps(model, 0.0)
    model.rpn.fg_bg_sampler = BalancedPositiveNegativeSampler(1_000_000, 0.5)
    model.roi_heads.fg_bg_sampler = BalancedPositiveNegativeSampler(1_000_000, 0.25)
    return model


def randomize(model, seed, residual_gain=1.0):
    """Sets values with which features neither vanish nor grow, and classes differ.

    Every residual block adds to the features; in a deep network each must add little.
    """
    generator = torch.Generator().manual_seed(seed)
    normal = lambda t: torch.randn(t.shape, generator=generator)
    uniform = lambda t: torch.rand(t.shape, generator=generator)
    with torch.no_grad():
        for name, value in model.state_dict().items():
            if name.endswith("running_var") or (value.dim() == 1 and name.endswith("weight")):
                value.copy_((0.5 + uniform(value)) * (residual_gain if "bn3.weight" in name else 1.0))
            elif value.dim() == 1:
                value.copy_(0.1 * normal(value))
            else:
                fan = value[0].numel() if "kps_score" not in name and "conv5_mask" not in name else value.shape[0] * 4
                gain = 0.2 if "bbox_pred" in name else 0.5 if "cls_" in name else 1.4
                value.copy_(gain * normal(value) / fan**0.5)


def export(folder, kind, model, limits, narrow):
    image = read_image()
    model.eval()
    tensors = {}
    with torch.no_grad():
        images, _ = model.transform([image])
        features = model.backbone(images.tensors)
        tensors["preprocessed"] = images.tensors
        levels = list(features.values())
        for level, feature in enumerate(levels, 2):
            tensors[f"features.p{level}"] = feature
        anchors = model.rpn.anchor_generator(images, levels)[0]
        counts = [3 * f.shape[2] * f.shape[3] for f in levels]
        for level, part in enumerate(anchors.split(counts), 2):
            tensors[f"anchors.p{level}"] = part
        tensors["proposals.boxes"] = model.rpn(images, features)[0][0]
        found = model([image])[0]
    tensors["detections.boxes"] = found["boxes"]
    tensors["detections.scores"] = found["scores"]
    tensors["detections.classes"] = found["labels"] - 1
    if kind == "keypoint":
        places = found["keypoints"].clone()
        places[:, :, 2] = found["keypoints_scores"]
        tensors["detections.keypoints"] = places
    if kind == "mask":
        tensors["detections.masks"] = (found["masks"][:, 0] > 0.5).to(torch.uint8)
    print(kind, "detections", tuple(found["boxes"].shape), "scores", found["scores"][:5].tolist())
    tensors.update(training_step(model, kind, image))
    save_file({k: v.detach().contiguous() for k, v in tensors.items()}, folder / "expected.safetensors")
    names = {k: v.contiguous() for k, v in model.state_dict().items()}
    save_file(names, folder / "weights.safetensors")
    config = {"kind": kind, "numerics": "torchvision", "classes": 1 if kind == "keypoint" else CLASSES}
    config |= {"min_size_test": limits["min_size"], "max_size_test": limits["max_size"]}
    config["detections_per_image"] = limits["box_detections_per_img"]
    if narrow:
        config |= {
            "keypoints": KEYPOINTS,
            "pre_nms_topk": limits["rpn_pre_nms_top_n_test"],
            "post_nms_topk_test": limits["rpn_post_nms_top_n_test"],
            "post_nms_topk_train": limits["rpn_post_nms_top_n_train"],
            "stem_out_channels": 16,
            "res2_out_channels": 16,
            "width_per_group": 4,
            "num_blocks": [1, 1, 1, 1],
            "fpn_channels": CHANNELS,
            "box_head_fc": FC,
            "keypoint_convs": CHANNELS,
            "mask_convs": CHANNELS,
        }
    (folder / "config.json").write_text(json.dumps(config, indent=1) + "\n")


def export_exact_gradients(folder, kind, model):
    """The gradients of the same step in double precision, for measuring the rounding of single precision."""
    tensors = training_step(model.double(), kind, read_image().double())
    gradients = {k: v.float().contiguous() for k, v in tensors.items() if k.startswith("gradients.")}
    save_file(gradients, folder / "exact.safetensors")


def read_image():
    return torch.from_numpy(np.array(Image.open(IMAGE).convert("RGB"))).permute(2, 0, 1).float() / 255


def count_detections(model):
    model.eval()
    image = read_image()
    with torch.no_grad():
        return len(model([image])[0]["scores"])


def randomize_until_found(model, seed, residual_gain=1.0):
    """Repeats `randomize` until there are at least four detections, because some random networks have none."""
    while randomize(model, seed, residual_gain) or count_detections(model) < 4:
        seed += 10


def training_step(model, kind, image):
    height, width = image.shape[1:]
    boxes = torch.tensor([[90.0, 70.0, 330.0, 300.0], [300.0, 200.0, 610.0, 430.0]], dtype=image.dtype)
    target = {"boxes": boxes, "labels": torch.tensor([1, 1 if kind == "keypoint" else 2])}
    if kind == "keypoint":
        # Not on the border of two cells, where rounding would decide.
        steps = torch.linspace(0.11, 0.85, model.roi_heads.keypoint_predictor.kps_score_lowres.out_channels)
        x = boxes[:, 0, None] + steps * (boxes[:, 2] - boxes[:, 0])[:, None]
        y = boxes[:, 1, None] + steps.flip(0) ** 2 * (boxes[:, 3] - boxes[:, 1])[:, None]
        visible = torch.ones_like(x)
        visible[1, 2] = 0
        # torchvision accepts keypoints only in single precision.
        target["keypoints"] = torch.stack([x, y, visible], 2).float()
    if kind == "mask":
        masks = []
        for x1, y1, x2, y2 in boxes.tolist():
            mask = Image.new("L", (width, height))
            ImageDraw.Draw(mask).polygon([(x1, y1), (x2, (y1 + y2) / 2), ((x1 + x2) / 2, y2)], fill=1)
            masks.append(np.array(mask))
        target["masks"] = torch.from_numpy(np.stack(masks))
    model.train()
    model.zero_grad()
    losses = model([image], [{k: v.clone() for k, v in target.items()}])
    sum(losses.values()).backward()
    _, (resized,) = model.transform([image], [target])
    print(kind, {k: v.item() for k, v in losses.items()})
    tensors = {"targets.boxes": resized["boxes"], "targets.classes": resized["labels"] - 1}
    for name in ("keypoints", "masks"):
        if name in resized:
            tensors[f"targets.{name}"] = resized[name]
    for name, value in losses.items():
        tensors["losses." + LOSSES.get(name, name)] = value.reshape(1)
    parameters = dict(model.named_parameters())
    for name in GRADIENTS:
        if name in parameters:
            tensors["gradients." + name] = parameters[name].grad
    return tensors


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--whole", type=pathlib.Path)
    whole = parser.parse_args().whole
    torch.set_num_threads(1)
    if whole:
        whole.mkdir(parents=True, exist_ok=True)
        limits = {"min_size": 240, "max_size": 400, "box_detections_per_img": 20}
        model = build("keypoint", False, limits)
        randomize_until_found(model, 7, 0.2)
        export(whole, "keypoint", model, limits, False)
        export_exact_gradients(whole, "keypoint", model)
        return
    # The committed files depend on the version; the test that runs if torch is installed accepts any version.
    assert torchvision.__version__.startswith("0.22.1"), torchvision.__version__
    # 640x480 becomes 166x125 or 166x124, which shows how sizes are rounded.
    limits = {
        "min_size": 125,
        "max_size": 400,
        "rpn_pre_nms_top_n_train": 200,
        "rpn_pre_nms_top_n_test": 200,
        "rpn_post_nms_top_n_train": 100,
        "rpn_post_nms_top_n_test": 60,
        "box_detections_per_img": 10,
    }
    for seed, kind in enumerate(("faster", "keypoint", "mask"), 1):
        folder = HERE / kind
        folder.mkdir(exist_ok=True)
        model = build(kind, True, limits)
        randomize_until_found(model, seed)
        export(folder, kind, model, limits, True)


if __name__ == "__main__":
    main()
