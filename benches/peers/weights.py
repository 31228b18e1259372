"""Reads the weights that `sdg-bench weights` wrote, so that both sides run the same network on the same numbers."""

import json
import re

import numpy as np

# Converts our names, which are Detectron2's with two exceptions, to torchvision's.
TORCHVISION = [
    (r"^backbone\.bottom_up\.stem\.conv1\.norm\.", "backbone.body.bn1."),
    (r"^backbone\.bottom_up\.stem\.conv1\.", "backbone.body.conv1."),
    (r"^backbone\.bottom_up\.res(\d)\.(\d+)\.shortcut\.norm\.", r"backbone.body.layer\1.\2.downsample.1."),
    (r"^backbone\.bottom_up\.res(\d)\.(\d+)\.shortcut\.", r"backbone.body.layer\1.\2.downsample.0."),
    (r"^backbone\.bottom_up\.res(\d)\.(\d+)\.conv(\d)\.norm\.", r"backbone.body.layer\1.\2.bn\3."),
    (r"^backbone\.bottom_up\.res(\d)\.", r"backbone.body.layer\1."),
    (r"^backbone\.fpn\.fpn_lateral(\d)\.", r"backbone.fpn.inner_blocks.\1.0."),
    (r"^backbone\.fpn\.fpn_output(\d)\.", r"backbone.fpn.layer_blocks.\1.0."),
    (r"^proposal_generator\.rpn_head\.conv\.", "rpn.head.conv.0.0."),
    (r"^proposal_generator\.rpn_head\.objectness_logits\.", "rpn.head.cls_logits."),
    (r"^proposal_generator\.rpn_head\.anchor_deltas\.", "rpn.head.bbox_pred."),
    (r"^roi_heads\.box_head\.fc1\.", "roi_heads.box_head.fc6."),
    (r"^roi_heads\.box_head\.fc2\.", "roi_heads.box_head.fc7."),
    (r"^roi_heads\.keypoint_head\.score_lowres\.", "roi_heads.keypoint_predictor.kps_score_lowres."),
    (r"^roi_heads\.keypoint_head\.conv_fcn\.(\d+)\.", r"roi_heads.keypoint_head.\1."),
    (r"^roi_heads\.mask_head\.mask_fcn\.(\d+)\.", r"roi_heads.mask_head.\1.0."),
    (r"^roi_heads\.mask_head\.deconv\.", "roi_heads.mask_predictor.conv5_mask."),
    (r"^roi_heads\.mask_head\.predictor\.", "roi_heads.mask_predictor.mask_fcn_logits."),
]


def read(path, module=""):
    """Reads the arrays of a safetensors file of floats by name: those under `module`, without this prefix."""
    with open(path, "rb") as file:
        header = json.loads(file.read(int.from_bytes(file.read(8), "little")))
        data = file.read()
    arrays = {}
    for name, entry in header.items():
        if name != "__metadata__" and name.startswith(module):
            if entry["dtype"] not in ("F32", "F16"):
                raise ValueError(f"{path}: {name}: expected F32 or F16, found {entry['dtype']}")
            begin, end = entry["data_offsets"]
            values = np.frombuffer(data[begin:end], dtype=np.float32 if entry["dtype"] == "F32" else np.float16)
            arrays[name.removeprefix(module)] = values.astype(np.float32).reshape(entry["shape"])
    return arrays


def torchvision_name(name):
    for pattern, replacement in TORCHVISION:
        found, count = re.subn(pattern, replacement, name)
        if count == 0:
            continue
        # Our stages and levels count from 2, torchvision's layers from 1, its pyramid and heads from 0.
        found = re.sub(r"(?<=body\.layer)\d", lambda m: str(int(m[0]) - 1), found)
        found = re.sub(r"(?<=_blocks\.)\d", lambda m: str(int(m[0]) - 2), found)
        return re.sub(r"(?<=roi_heads\.keypoint_head\.)\d+", lambda m: str(2 * int(m[0])), found)
    return name


def load(module, arrays, rename=lambda name: name):
    """Sets every parameter and buffer of a torch module; anything missing or left over is an error."""
    import torch

    state = {rename(name): torch.from_numpy(array.copy()) for name, array in arrays.items()}
    # Some versions of torchvision count batches in norms that are never trained.
    wanted = {name for name in module.state_dict() if not name.endswith("num_batches_tracked")}
    if wanted != set(state):
        missing, unused = sorted(wanted - set(state)), sorted(set(state) - wanted)
        raise ValueError(f"weights do not fit: missing {missing[:3]}, unused {unused[:3]}")
    module.load_state_dict(state, strict=False)
    return module
