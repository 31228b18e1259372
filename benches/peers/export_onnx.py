"""Writes the R50-FPN backbone with our weights as ONNX: `export_onnx.py WEIGHTS OUT`."""

import sys

import torch
from torchvision.ops.misc import FrozenBatchNorm2d

import r50


def with_plain_norms(module):
    """Replaces torchvision's frozen batch norms by batch norms that exporters know, so that the runtimes can fold them."""
    for name, child in module.named_children():
        if isinstance(child, FrozenBatchNorm2d):
            norm = torch.nn.BatchNorm2d(len(child.weight), eps=child.eps)
            norm.load_state_dict(child.state_dict(), strict=False)
            setattr(module, name, norm)
        else:
            with_plain_norms(child)
    return module


class Levels(torch.nn.Module):
    def __init__(self, backbone):
        super().__init__()
        self.backbone = backbone

    def forward(self, images):
        return tuple(self.backbone(images).values())


def main():
    if len(sys.argv) != 3:
        sys.exit("usage: export_onnx.py WEIGHTS OUT")
    model = Levels(with_plain_norms(r50.resnet_fpn(sys.argv[1]))).eval()
    with torch.no_grad():
        torch.onnx.export(model, (r50.backbone_input(),), sys.argv[2], external_data=False)


main()
