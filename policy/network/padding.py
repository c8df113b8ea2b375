"""Arrays of different lengths in one tensor."""

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor


def pad(rows: Sequence[np.ndarray]) -> tuple[Tensor, Tensor]:
    """Stack arrays of different lengths.

    Args:
        rows: B arrays that agree in all but their first size.

    Returns:
        (B, L, ...) float32 (or bool) values, zero beyond each array's end, with L at least 1;
        and the (B, L) mask of real entries.
    """
    length = max(1, *(len(row) for row in rows))
    dtype = np.bool_ if rows[0].dtype == np.bool_ else np.float32
    values = np.zeros((len(rows), length, *rows[0].shape[1:]), dtype=dtype)
    mask = np.zeros((len(rows), length), dtype=np.bool_)
    for i, row in enumerate(rows):
        values[i, : len(row)] = row
        mask[i, : len(row)] = True
    return torch.from_numpy(values), torch.from_numpy(mask)
