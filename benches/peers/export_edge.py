"""Writes the `edge` detector of a grasp model as ONNX: `export_edge.py MODEL.sdg OUT`.

From the network's input `[1, 3, 256, 320]` to boxes `[R, 4]`, scores `[R]` and keypoints `[R, K, 3]`, best first: all
that our own detector does between resizing and reading off the grasp.
"""

import sys

import torch
import torch.nn.functional as F
from torchvision.ops import roi_align

import edge
import weights


class Detection(edge.Detector):
    def forward(self, images):
        return self.detect(images)

    def pool(self, features, boxes, size):
        """As the detector's own, without its question whether a level has any box: a trace keeps one answer for ever."""
        rois = F.pad(boxes[0], (1, 0))
        areas = (rois[:, 3] - rois[:, 1]) * (rois[:, 4] - rois[:, 2])
        levels = torch.floor(4 + torch.log2(areas.sqrt() / 112 + 1e-8)).clamp(2, 5).long() - 2
        crops = features[0].new_zeros(rois.shape[0], features[0].shape[1], size, size)
        for level in range(4):
            idxs = torch.where(levels == level)[0]
            pooled = roi_align(features[level], rois[idxs], size, 1 / edge.STRIDES[level], 2, aligned=True)
            crops = crops.index_put((idxs,), pooled)
        return crops


def main():
    if len(sys.argv) != 3:
        sys.exit("usage: export_edge.py MODEL.sdg OUT")
    detector = weights.load(Detection(), weights.read(sys.argv[1], "network."))
    example = torch.zeros(1, 3, edge.HEIGHT + -edge.HEIGHT % edge.DIVISIBILITY, edge.WIDTH)
    # Traced on noise: on an empty picture nothing is found, and what follows would not be seen.
    example.normal_(generator=torch.Generator().manual_seed(1))
    with torch.no_grad():
        # The exporter by tracing: how many boxes are kept is known only when it runs, which the newer one refuses.
        torch.onnx.export(
            detector.eval(),
            (example,),
            sys.argv[2],
            dynamo=False,
            opset_version=17,
            input_names=["images"],
            output_names=["boxes", "scores", "keypoints"],
            dynamic_axes={"boxes": {0: "found"}, "scores": {0: "found"}, "keypoints": {0: "found"}},
        )


main()
