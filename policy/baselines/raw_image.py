"""Raw images instead of a cloud: the instruction against whole pictures, or a grid of crops."""

from typing import ClassVar

import numpy as np
from jaxtyping import Float

from policy.actions import ActionCandidates
from policy.arrays import checked_array
from policy.baselines.one_phase import OnePhasePolicy
from policy.errors import MissingImagesError
from policy.images import ImageSource
from policy.observation import Observation


class _PartsPolicy(OnePhasePolicy):
    """Grasps in the part of the pictures that is most similar to the phrase."""

    num_parts: ClassVar[int]

    def _logits(
        self, observation: Observation, candidates: ActionCandidates, rng: np.random.Generator
    ) -> Float[np.ndarray, " K"]:
        """Rank grasps by the most similar part in which they appear, then by the prior.

        Returns:
            K logits: the rank of the similarity of a grasp's part among those of all grasps, from
            0, plus half of the prior. Grasps that are in no picture rank last. Without grasps, no
            picture is described.
        """
        logits = candidates.prior.astype(np.float64) / 2
        if len(candidates):
            if observation.images is None:
                raise MissingImagesError(
                    f"images: got None for the policy {self.name!r}, which looks at the pictures; "
                    "expected an ImageSource. Give the observation one, or use 'grounding'."
                )
            phrase = observation.phrase_pooled
            phrase = observation.text_pooled if phrase is None else phrase
            similarity = part_similarity(
                observation.images, self.num_parts, phrase, candidates.positions
            )
            # Equal similarity is the same part; half of the prior never outweighs a rank.
            logits = logits + np.unique(similarity, return_inverse=True)[1]
        return logits


class RawImageGridPolicy(_PartsPolicy):
    """Grasps what appears in the crop that is most similar to the phrase.

    The original encodes crops of the raw image on a grid with CLIP, and a grasp network trained
    behind it turns their features into an action. Simplified here:

    - Nothing is trained. The similarity of a crop's feature with that of the phrase that says what
      to pick is the score of all grasps whose tool centre point is projected into that crop; of
      several views, the most similar crop counts. Within a crop, the prior decides.
    - The grid has 8 x 8 crops a view. Of views of 1280 x 720 pixels, 0.75 m above the table, a crop
      covers 13 by 7 cm, about an object with a part of its neighbours.
    - A crop's feature is the mean over the encoder's map of the crop alone.
    - What hides a grasp from a view is not asked: a crop knows no depth.
    - The original only grasps. In the place phase, this is the policy `grounding`.

    Raises:
        MissingImagesError: By `score`, if there are grasps to score, but no pictures.
    """

    name = "raw-image-grid"
    num_parts = 8


class RawImagePolicy(_PartsPolicy):
    """Compares the phrase with each picture as a whole; nearly blind by construction.

    The original feeds CLIP's feature of the whole raw image to a trained network that gives an
    action. Without that network the feature of a picture is the same for all grasps in it: here
    the grasps inside the most similar picture come first, and that is nearly always all of them.
    What is left is the generator's prior. Otherwise as `RawImageGridPolicy`.
    """

    name = "raw-image"
    num_parts = 1


def part_similarity(
    images: ImageSource,
    num_parts: int,
    phrase: Float[np.ndarray, " C"],
    positions: Float[np.ndarray, "K 3"],
) -> Float[np.ndarray, " K"]:
    """Find the most similar part, of all pictures, in which each position appears.

    Args:
        images: The pictures; parts in which nothing appears are not described.
        num_parts: Parts along each side of a picture.
        phrase: (C,) text feature.
        positions: (K, 3) world coordinates, metres.

    Returns:
        (K,) cosines; minus infinity for positions that are in no picture.
    """
    best = np.full(len(positions), -np.inf)
    for picture, frame in enumerate(images.frames):
        part = frame.parts_of(positions, num_parts)
        used, where = np.unique(part[part >= 0], return_inverse=True)
        if len(used):
            features = images.describe(picture, num_parts, used)
            features = checked_array("features of parts", features, (len(used), len(phrase)))
            cosine = features.astype(np.float64) @ phrase
            best[part >= 0] = np.maximum(best[part >= 0], cosine[where])
    return best
