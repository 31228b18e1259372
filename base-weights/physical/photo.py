"""Effects of a phone or webcam on the picture: distortion, vignetting, exposure, white balance, blur, noise, tone curve,
sharpening, JPEG."""

from dataclasses import dataclass

import cv2
import numpy as np

import surfaces
from camera import HEIGHT, WIDTH
from scene import PAD


@dataclass
class Faults:
    blur: float
    sharpening: float
    noise: float
    vignetting: float
    contrast: float
    quality: int

    @staticmethod
    def draw(rng):
        return Faults(
            blur=rng.uniform(0.35, 0.7),
            sharpening=rng.uniform(0.3, 0.9),
            noise=rng.uniform(0.004, 0.011),
            vignetting=rng.uniform(0.1, 0.3),
            contrast=rng.uniform(0.0, 0.35),
            quality=int(rng.integers(88, 92)),
        )


MAX_ITEM_LUMINANCE = 0.65  # limit of the 60th percentile over the objects on the table; 1 is the sensor's limit


def develop(rng, cam, x, faults, ground, things, coloured_light=False, exposure=None, noise_gain=1.0):
    """8-bit RGB (HEIGHT, WIDTH, 3) of a rendered picture.

    `exposure` is the picture's mean; without it the mean follows from the table, but is lower if the objects on the
    table (the mask `things`) would be overexposed.
    """
    u, v = np.meshgrid(np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5)
    xn, yn = (u - WIDTH / 2) / cam.f, (v - HEIGHT / 2) / cam.f
    xs, ys = cam.undistort(xn, yn)
    map_x = (xs * cam.f + WIDTH / 2 + PAD - 0.5).astype(np.float32)
    map_y = (ys * cam.f + HEIGHT / 2 + PAD - 0.5).astype(np.float32)
    x = cv2.remap(x, map_x, map_y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    x = x * (1 / (1 + xn * xn + yn * yn) ** (1 + faults.vignetting))[..., None].astype(np.float32)

    luminance = x @ np.array([0.25, 0.65, 0.1], np.float32)
    mean = max(1e-6, np.mean(np.minimum(luminance, np.percentile(luminance, 97))))
    if exposure is None:
        gain = (0.10 + 0.36 * surfaces.LIGHTNESS.get(ground, 0.45)) * rng.uniform(0.85, 1.2) / mean
        if things.any():
            gain = min(gain, MAX_ITEM_LUMINANCE / max(1e-6, np.percentile(luminance[things], 60)))
    else:
        gain = exposure / mean
    x = x * gain

    mean = x.reshape(-1, 3).mean(0)
    strength = rng.uniform(0, 0.2) if coloured_light else rng.uniform(0.05, 0.3)
    balance = (mean.mean() / np.maximum(mean, 1e-4)) ** strength
    x = x * np.clip(balance, 0.8, 1.3) * rng.uniform(0.97, 1.03, 3)

    x = x + 0.025 * cv2.GaussianBlur(np.clip(x - 0.9, 0, 4), (0, 0), 7)  # veiling glare of highlights
    x = cv2.GaussianBlur(x.astype(np.float32), (0, 0), faults.blur)
    n = faults.noise * noise_gain
    sigma = np.sqrt(np.maximum(x, 0) * n * n * 2.0 + (0.25 * n) ** 2)  # shot and read noise
    x = np.clip(x + rng.standard_normal(x.shape).astype(np.float32) * sigma, 0, None)

    y = np.where(x < 0.8, x, 0.8 + 0.2 * (1 - np.exp(-(x - 0.8) / 0.2 * 0.7)))
    y = np.clip(y, 0, 1)
    y = np.where(y <= 0.0031308, 12.92 * y, 1.055 * y ** (1 / 2.4) - 0.055)
    y = (1 - faults.contrast) * y + faults.contrast * y * y * (3 - 2 * y)
    y = y + faults.sharpening * (y - cv2.GaussianBlur(y.astype(np.float32), (0, 0), 1.0))
    return (np.clip(y, 0, 1) * 255 + 0.5).astype(np.uint8)


def save(path, picture, faults):
    sampling = [cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_420]
    cv2.imwrite(path, picture[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, faults.quality, *sampling])
