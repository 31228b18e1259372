"""torchvision's R50-FPN and its detectors, with our weights."""

import torch
import torchvision
from torch.utils.flop_counter import FlopCounterMode
from torchvision.models.detection import FasterRCNN, KeypointRCNN, MaskRCNN
from torchvision.models.detection.backbone_utils import resnet_fpn_backbone
from torchvision.ops.misc import FrozenBatchNorm2d

import scene
import weights
from protocol import Work

NUM_KEYPOINTS = 17
# 32 parts per picture, and 32 of the 512 sampled proposals positive. The parts' own boxes are among the candidates, so
# this number is reached with any weights, and the keypoint or mask heads do the same work on both sides.
GRID = (8, 4)
POSITIVE_FRACTION = 32 / 512


def version(layout):
    return f"torch {torch.__version__.split('+')[0]}, torchvision {torchvision.__version__.split('+')[0]}"


def resnet_fpn(path):
    # Stages 2 to 4 of torchvision are res3 to res5: stem and res2 are frozen, as in Detectron2.
    backbone = resnet_fpn_backbone(
        backbone_name="resnet50", weights=None, norm_layer=FrozenBatchNorm2d, trainable_layers=3
    )
    if path is not None:
        arrays = {n.removeprefix("backbone."): a for n, a in renamed(path).items() if n.startswith("backbone.")}
        weights.load(backbone, arrays)
    return backbone


def renamed(path):
    return {weights.torchvision_name(name): array for name, array in weights.read(path).items()}


def detector(kind, path, layout):
    kinds = {"faster": FasterRCNN, "mask": MaskRCNN, "keypoint": KeypointRCNN}
    extra = {"num_keypoints": NUM_KEYPOINTS} if kind == "keypoint" else {}
    model = kinds[kind](
        resnet_fpn(None),
        num_classes=2,
        min_size=480,
        max_size=1333,
        box_positive_fraction=POSITIVE_FRACTION,
        **extra,
    )
    return weights.load(model, renamed(path)).to(memory_format=layout)


def image(layout, number=0):
    """`[3, 480, 640]` floats in [0, 1], from bytes, as a user of torchvision makes them."""
    return torch.from_numpy(scene.picture(number)).permute(2, 0, 1).float().div_(255)


def gflop_of(run):
    with FlopCounterMode(display=False) as counter:
        run()
    return counter.get_total_flops() / 1e9


def backbone_input():
    normalised = (image(None) - torch.tensor([0.485, 0.456, 0.406])[:, None, None]) / torch.tensor(
        [0.229, 0.224, 0.225]
    )[:, None, None]
    return normalised[None].contiguous()


def level_facts(levels):
    return {f"p{level + 2}": float(abs(values).mean()) for level, values in enumerate(levels)}


@torch.inference_mode()
def backbone(path, layout):
    model = resnet_fpn(path).eval().to(memory_format=layout)
    x = backbone_input().to(memory_format=layout)
    features = list(model(x).values())

    def run():
        with torch.inference_mode():
            model(x)

    return Work(run, level_facts(features), gflop_of(run), version(layout))


def inference(kind, path, layout):
    model = detector(kind, path, layout).eval()

    def run():
        with torch.inference_mode():
            return model([image(layout)])[0]

    found = {}
    gflop = gflop_of(lambda: found.update(run()))
    facts = {"boxes": len(found["boxes"]), "mean_score": float(found["scores"].mean())}
    if kind == "keypoint":
        facts["mean_keypoint_score"] = float(found["keypoints_scores"].mean())
    if kind == "mask":
        facts["mask_share"] = float((found["masks"] > 0.5).float().mean())
    return Work(run, facts, gflop, version(layout))


def training_step(kind, path, layout):
    model = detector(kind, path, layout).train()
    trained = [p for p in model.parameters() if p.requires_grad]
    optimizer = torch.optim.SGD(trained, lr=1e-5, momentum=0.9, weight_decay=1e-4, fused=True)
    boxes = scene.boxes(*GRID)
    target = {"boxes": torch.from_numpy(boxes), "labels": torch.ones(len(boxes), dtype=torch.int64)}
    if kind == "keypoint":
        target["keypoints"] = torch.from_numpy(scene.keypoints(boxes, NUM_KEYPOINTS))
    if kind == "mask":
        target["masks"] = torch.from_numpy(scene.masks(boxes))
    counts = {}
    heads = {"rois": model.roi_heads.box_head}
    if kind != "faster":
        heads["head_rois"] = model.roi_heads.keypoint_head if kind == "keypoint" else model.roi_heads.mask_head
    hooks = [
        head.register_forward_pre_hook(lambda _, inputs, name=name: counts.update({name: len(inputs[0])}))
        for name, head in heads.items()
    ]

    def run():
        optimizer.zero_grad(set_to_none=True)
        images = [image(layout, number) for number in range(2)]
        losses = model(images, [dict(target), dict(target)])
        sum(losses.values()).backward()
        optimizer.step()

    gflop = gflop_of(run)
    for hook in hooks:
        hook.remove()
    return Work(run, counts, gflop, version(layout))
