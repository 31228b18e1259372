"""Runs one work with one of the peers: `worker.py PEER WORK --weights FILE --threads N`.

`WORKS` lists the works; protocol.py has the protocol.
"""

import argparse
import os


def torch_layout(peer):
    import torch

    return torch.channels_last if peer.endswith("channels_last") else torch.contiguous_format


def r50(function, *leading):
    def build(peer, args):
        import r50 as module

        return getattr(module, function)(*leading, args.weights, torch_layout(peer))

    return build


def edge(function):
    def build(peer, args):
        import edge as module

        return getattr(module, function)(args.weights, torch_layout(peer))

    return build


def runtime(function):
    def build(_, args):
        import runtimes

        return getattr(runtimes, function)(args.onnx, args.threads)

    return build


def augmentation(function):
    def build(_, args):
        import augmentation as module

        return getattr(module, function)(args.demonstration, args.threads)

    return build


def gemm(_, args):
    import gemm as module

    return module.product()


TORCH = ("pytorch", "pytorch-channels_last")
# (peer, work): the function that builds it.
WORKS = {
    ("onnxruntime", "backbone"): runtime("onnxruntime_backbone"),
    ("openvino", "backbone"): runtime("openvino_backbone"),
    ("albumentations", "augmentation"): augmentation("four_operations"),
    ("albumentations-fused", "augmentation"): augmentation("one_affine"),
    ("pytorch", "gemm"): gemm,
}
for torch_peer in TORCH:
    WORKS[torch_peer, "backbone"] = r50("backbone")
    WORKS[torch_peer, "edge-detection"] = edge("detection")
    WORKS[torch_peer, "edge-training-step"] = edge("training_step")
    for rcnn in ("faster", "mask", "keypoint"):
        WORKS[torch_peer, f"{rcnn}-inference"] = r50("inference", rcnn)
        WORKS[torch_peer, f"{rcnn}-training-step"] = r50("training_step", rcnn)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("peer")
    parser.add_argument("work")
    parser.add_argument("--weights")
    parser.add_argument("--onnx")
    parser.add_argument("--demonstration")
    parser.add_argument("--threads", type=int, default=2)
    args = parser.parse_args()
    build = WORKS.get((args.peer, args.work))
    if build is None:
        known = ", ".join(f"{peer} {work}" for peer, work in sorted(WORKS))
        parser.error(f"expected one of {known}; found {args.peer} {args.work}")
    os.environ["OMP_NUM_THREADS"] = str(args.threads)
    os.environ["MKL_NUM_THREADS"] = str(args.threads)
    # No search for a newer release over the network.
    os.environ["NO_ALBUMENTATIONS_UPDATE"] = "1"

    def prepared():
        if args.peer in TORCH:
            import torch

            torch.manual_seed(1)
            torch.set_num_threads(args.threads)
        return build(args.peer, args)

    from protocol import serve

    serve(prepared)


main()
