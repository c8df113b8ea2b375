"""Depth images before fusion: flying pixels go, noise is averaged within a surface."""

import numpy as np
from jaxtyping import Float32


def filter_depth(
    depth_m: Float32[np.ndarray, "h w"],
    *,
    tolerance_m: float,
    min_neighbours: int,
    is_smoothed: bool,
) -> Float32[np.ndarray, "h w"]:
    """Remove flying pixels and, if wanted, average what remains with its neighbours.

    At a depth discontinuity a time-of-flight pixel can report a depth between the two surfaces.
    Such a pixel agrees with few of its eight neighbours, whereas a pixel on a surface, even at its
    rim, agrees with about half of them. The average takes only the neighbours that agree (a sigma
    filter, Lee 1983), so that it never mixes foreground and background.

    Args:
        depth_m: (H, W) float32 in metres; 0 = no return.
        tolerance_m: Two neighbours agree if their depths differ by at most this much.
        min_neighbours: Agreeing neighbours, of 8, that a pixel needs to be kept.
        is_smoothed: Whether to average; else the kept depths stay as measured.

    Returns:
        (H, W) float32; 0 where there was no return or the pixel was removed.
    """
    height, width = depth_m.shape
    padded = np.pad(depth_m, 1)
    total = depth_m.copy()
    num_agreeing = np.zeros(depth_m.shape, np.float32)
    for dv in (0, 1, 2):
        for du in (0, 1, 2):
            if dv == du == 1:
                continue
            neighbour = padded[dv : dv + height, du : du + width]
            # A neighbour without return (0) never agrees: no sensor reports less than 0.25 m.
            agrees = (np.abs(neighbour - depth_m) <= tolerance_m).astype(np.float32)
            num_agreeing += agrees
            if is_smoothed:
                agrees *= neighbour
                total += agrees
    is_kept = (num_agreeing >= min_neighbours) & (depth_m > 0)
    filtered = total / (1.0 + num_agreeing) if is_smoothed else total
    return np.where(is_kept, filtered, np.float32(0.0))
