"""Changes to a picture that leave what it shows as it is."""

import numpy as np

_PLAIN_SHARE = 0.5


def disturb(rgb: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Change exposure, contrast, white balance, sharpness and noise of half of the pictures.

    Args:
        rgb: (H, W, 3) uint8.
        rng: Source of randomness.

    Returns:
        (H, W, 3) uint8.
    """
    if rng.random() < _PLAIN_SHARE:
        return rgb
    image = rgb.astype(np.float32) / 255
    image = image ** rng.uniform(0.7, 1.4) * rng.uniform(0.8, 1.2)
    image *= 1 + rng.uniform(-0.06, 0.06, 3).astype(np.float32)
    image = (image - 0.5) * rng.uniform(0.8, 1.15) + 0.5
    if rng.random() < 0.4:
        image = (image + np.roll(image, 1, 0) + np.roll(image, 1, 1)) / 3
    image += rng.normal(size=image.shape).astype(np.float32) * rng.uniform(0, 0.03)
    return (255 * np.clip(image, 0, 1)).astype(np.uint8)
