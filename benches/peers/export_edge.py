"""Writes the `edge` detector of a grasp model as ONNX: `export_edge.py MODEL.sdg OUT`.

The export computes boxes `[R, 4]`, scores `[R]` and keypoints `[R, K, 3]`, best first, from the network's input
`[1, 3, 256, 320]`: all steps of our own detector between resizing and the computation of the grasp.
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
        """Pools like the detector, but without the test whether a level has any box: a trace keeps only one result."""
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
    # Traced on noise, because on an empty picture nothing is found and the following steps would not be traced.
    example.normal_(generator=torch.Generator().manual_seed(1))
    with torch.no_grad():
        # This exporter traces the model; the newer one rejects a number of boxes that is known only at run time.
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
