"""From radiance to the file of a camera: blur, vignetting, exposure, white balance, noise, sRGB, JPEG. Needs numpy and
Pillow."""

import io

import numpy as np
from PIL import Image, ImageFile

import draw

FINEST_JPEG = 95    # from this quality on, the colours have full resolution
LARGEST_FILE, LEAST_QUALITY, QUALITY_STEP = 45_000, 50, 5  # bytes; of the drawn pictures


def blurred(image: np.ndarray, sigma: float) -> np.ndarray:
    """Gaussian, separable, cut at four standard deviations; edges are replicated."""
    if sigma < 0.05:
        return image
    reach = max(1, int(np.ceil(4 * sigma)))
    # The mean of the Gaussian over each pixel, approximated by seven points.
    at = np.arange(-reach, reach + 1)[:, None] + (np.arange(7) - 3)[None, :] / 7
    kernel = np.exp(-(at**2) / (2 * sigma**2)).mean(1)
    kernel /= kernel.sum()
    for axis in (0, 1):
        pad = [(0, 0)] * image.ndim
        pad[axis] = (reach, reach)
        wide = np.pad(image, pad, mode="edge")
        n = image.shape[axis]
        image = sum(k * np.take(wide, range(i, i + n), axis) for i, k in enumerate(kernel))
    return image


def corner_angle(camera) -> float:
    """Angle between the optical axis and the sensor's corner, rad."""
    return float(np.arctan(np.hypot(camera.width, camera.height) / 2 / camera.focal_px))


def vignetting_of(scene: draw.Scene) -> np.ndarray:
    """(h, w): share of the light that remains, 1 - v (theta / theta_corner)^2."""
    x, y, w, h = scene.crop
    c = scene.camera
    u, v = np.meshgrid(x + np.arange(w) - (c.width - 1) / 2, y + np.arange(h) - (c.height - 1) / 2)
    theta = np.arctan(np.hypot(u, v) / c.focal_px)
    return 1 - scene.sensor.vignetting * (theta / corner_angle(c)) ** 2


def encoded(linear: np.ndarray) -> np.ndarray:
    """sRGB (IEC 61966-2-1)."""
    v = np.clip(linear, 0, 1)
    return np.where(v <= 0.0031308, 12.92 * v, 1.055 * v ** (1 / 2.4) - 0.055)


def gains_of(sensor: draw.Sensor, white: np.ndarray, illuminant: np.ndarray) -> np.ndarray:
    """(3,) picture value per radiance. `white`: radiance of the brightest paper; `illuminant`: colour to which the
    camera adapts, by the share `adaptation`."""
    balance = (illuminant[1] / illuminant) ** sensor.adaptation * np.array(sensor.white_balance)
    return sensor.level / (white * balance).max() * balance


def compressed(picture: Image.Image, quality: int) -> bytes:
    out = io.BytesIO()
    ImageFile.MAXBLOCK = 3 * picture.width * picture.height  # Pillow's buffer for `optimize`: too small for noise
    picture.save(out, "JPEG", quality=quality, subsampling=0 if quality >= FINEST_JPEG else 2, optimize=True)
    return out.getvalue()


def developed(scene: draw.Scene, radiance: np.ndarray, gains: np.ndarray) -> tuple[bytes, int]:
    """The JPEG file and its quality: as drawn, or less for at most LARGEST_FILE, but LEAST_QUALITY. Of the set defects
    it is always as drawn. `radiance`: (h, w, 3)."""
    s = scene.sensor
    rng = np.random.default_rng(scene.numbers().seed(f"noise.{scene.frame}"))
    linear = blurred(radiance, s.blur_px) * vignetting_of(scene)[..., None] * gains
    if s.electrons > 0:
        linear = linear + rng.normal(size=linear.shape) * np.sqrt(np.maximum(linear, 0) / s.electrons + s.read_noise**2)
    picture = Image.fromarray((encoded(linear) * 255 + 0.5).astype(np.uint8))
    quality = s.jpeg_quality
    while True:
        file = compressed(picture, quality)
        if len(file) <= LARGEST_FILE or quality <= LEAST_QUALITY or scene.defect:
            return file, quality
        quality = max(LEAST_QUALITY, quality - QUALITY_STEP)
