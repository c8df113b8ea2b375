"""How well points fit a text: cosine, or relevancy against what everything resembles."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float32

from perception.encoders.base import TextFeatures


def relevancy(
    features: Float32[np.ndarray, "n c"],
    text: TextFeatures,
    negatives: Sequence[TextFeatures],
    unwanted: Sequence[TextFeatures] = (),
    *,
    sharpness: float,
) -> Float32[np.ndarray, " n"]:
    """Compare features with a text, relative to texts that fit anything.

    The cosine alone also reflects how much a point resembles text as such. Following LERF (Kerr et
    al. 2023), a point is asked which fits better, the text or a negative such as "object", and the
    answer against the strongest negative counts:

        min_i exp(s cos_text) / (exp(s cos_text) + exp(s cos_negative_i))

    so that 0.5 means "as well as the best negative". Without negatives the result is the cosine.

    A sentence may name what it does not ask for: "get something to drink, put it near the soap". A
    point is then asked again, with the texts `unwanted` instead of the negatives, and the answers
    are multiplied. As one more negative, such a text would count only where it beats "object"; as a
    factor it weighs wherever the two texts compete.

    Args:
        features: (N, C) float32, unit rows.
        text: The text that is looked for.
        negatives: Features of the negative prompts.
        unwanted: Features of texts that are spoken of and not looked for.
        sharpness: s, how steeply the answer turns from 0 to 1.

    Returns:
        (N,) float32: 0..1 with negatives, else -1..1.
    """
    cosine = features @ text.pooled
    if not negatives:
        return cosine
    answer = _answer(features, cosine, negatives, sharpness)
    if unwanted:
        answer *= _answer(features, cosine, unwanted, sharpness)
    return answer


def _answer(
    features: Float32[np.ndarray, "n c"],
    cosine: Float32[np.ndarray, " n"],
    rivals: Sequence[TextFeatures],
    sharpness: float,
) -> Float32[np.ndarray, " n"]:
    """Tell how much better than the strongest rival a text fits, 0..1."""
    strongest = (features @ np.stack([r.pooled for r in rivals], axis=1)).max(axis=1)
    return (1.0 / (1.0 + np.exp(-sharpness * (cosine - strongest)))).astype(np.float32)
