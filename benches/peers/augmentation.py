"""The augmentation of the paper SingleDemoGrasp with albumentations: rotation, tint, shift, scale, also of box and
keypoints."""

from concurrent.futures import ThreadPoolExecutor

import albumentations
import cv2
import numpy as np

from protocol import Work

SAMPLES = 64
NUM_KEYPOINTS = 12


def operations(fused):
    tint = albumentations.MultiplicativeNoise(multiplier=(0.4, 1.5), per_channel=True, elementwise=False, p=1)
    shift = {"x": (-30, 30), "y": (-30, 30)}
    affine = albumentations.Affine
    if fused:
        return [affine(rotate=(-180, 180), translate_px=shift, scale=(0.75, 1.3), p=1), tint]
    turn = affine(rotate=(-180, 180), scale=1, p=1)
    return [turn, tint, affine(translate_px=shift, scale=1, p=1), affine(scale=(0.75, 1.3), p=1)]


def augmenter(fused, seed):
    return albumentations.Compose(
        operations(fused),
        bbox_params=albumentations.BboxParams("pascal_voc", label_fields=["labels"]),
        keypoint_params=albumentations.KeypointParams("xy", remove_invisible=False),
        seed=seed,
    )


def work(fused, demonstration, threads):
    image = cv2.cvtColor(cv2.imread(demonstration), cv2.COLOR_BGR2RGB)
    height, width = image.shape[:2]
    along = np.linspace(0.4, 0.6, NUM_KEYPOINTS)[:, None]
    marks = {
        "bboxes": np.array([[0.3 * width, 0.3 * height, 0.7 * width, 0.7 * height]]),
        "labels": [0],
        "keypoints": along * np.array([[width, height]]),
    }
    # Two ways to use the threads; the faster one on this machine represents albumentations.
    pool = ThreadPoolExecutor(threads)
    augmenters = [augmenter(fused, seed) for seed in range(threads)]

    def many(augment, count):
        for _ in range(count):
            augment(image=image, **marks)

    def inside_a_sample():
        many(augmenters[0], SAMPLES)

    def across_samples():
        list(pool.map(lambda augment: many(augment, SAMPLES // threads), augmenters))

    run = faster([(inside_a_sample, threads), (across_samples, 1)])
    version = f"albumentations {albumentations.__version__}, opencv {cv2.__version__}"
    return Work(run, {"width": width, "height": height}, None, version, SAMPLES)


def faster(ways):
    """Times each way after a warm-up, sets OpenCV's threads for the faster one and returns it."""
    import time

    seconds = []
    for run, threads in ways:
        cv2.setNumThreads(threads)
        run()
        start = time.perf_counter()
        run()
        seconds.append(time.perf_counter() - start)
    run, threads = ways[seconds.index(min(seconds))]
    cv2.setNumThreads(threads)
    return run


def four_operations(demonstration, threads):
    """The operations of the paper's program in sequence, the same as ours."""
    return work(False, demonstration, threads)


def one_affine(demonstration, threads):
    """Rotation, shift and scale in one warp, without clipping the picture between them."""
    return work(True, demonstration, threads)
