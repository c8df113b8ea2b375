"""Texts compared with features: encoded once, remembered, refused where they are too long."""

from collections.abc import Sequence

import numpy as np

from perception.cache import LruCache
from perception.encoders.base import Encoder, TextFeatures, checked_text
from perception.errors import InvalidTextError
from perception.similarity import relevancy

DEFAULT_NEGATIVE_PROMPTS = ("object", "table", "stuff", "surface", "background")
DEFAULT_SHARPNESS = 10.0
MAX_TEXT_TOKENS = 77  # CLIP's context, start and end tokens included
_NUM_CACHED_TEXTS = 64

# "{}" is the text itself. CLIP was trained on captions: names of things alone are rare among them,
# and the mean over several wordings is steadier than one (Radford et al. 2021, section 3.1.4).
PLAIN_PROMPT = ("{}",)
CAPTION_PROMPTS = ("{}", "a photo of {}", "a close-up photo of {}", "{} on a table")


class TextScorer:
    """Compares features with texts in the space of one encoder."""

    def __init__(
        self,
        encoder: Encoder,
        *,
        negative_prompts: Sequence[str] = DEFAULT_NEGATIVE_PROMPTS,
        sharpness: float = DEFAULT_SHARPNESS,
        prompts: Sequence[str] = PLAIN_PROMPT,
    ) -> None:
        """Prepare a scorer.

        Args:
            encoder: The encoder whose text space the features lie in.
            negative_prompts: Texts that fit anything; see `perception.similarity.relevancy`.
            sharpness: Steepness of the relevancy.
            prompts: Wordings that each text is put into, `{}` standing for the text; their features
                are averaged. `CAPTION_PROMPTS` suits CLIP.

        Raises:
            InvalidTextError: If there is no wording, or one of them has no `{}`.
        """
        if not prompts or any(prompt.count("{}") != 1 for prompt in prompts):
            raise InvalidTextError(
                f"Prompts are {tuple(prompts)}; expected one or more texts, each with one '{{}}' "
                "where the text goes."
            )
        self.prompts = tuple(prompts)
        self.encoder = encoder
        self.negative_prompts = tuple(negative_prompts)
        self.sharpness = sharpness
        self._texts: LruCache[TextFeatures] = LruCache(_NUM_CACHED_TEXTS)

    def encode(self, text: str) -> TextFeatures:
        """Encode a text, or remember its features.

        Args:
            text: Any text with at least one word.

        Returns:
            Its features.

        Raises:
            InvalidTextError: If it is empty or longer than `MAX_TEXT_TOKENS`.
        """
        key = f"{self.encoder.fingerprint}|{text}"
        features = self._texts.get(key)
        if features is None:
            check_length(text)
            features = self.encoder.encode_text(text)
            self._texts.put(key, features)
        return features

    def score(self, features: np.ndarray, text: str, unwanted: Sequence[str] = ()) -> np.ndarray:
        """Compare features with a text.

        Args:
            features: (N, C) float32, unit rows.
            text: What is looked for.
            unwanted: What is spoken of, but not looked for. Makes no difference without
                `negative_prompts`.

        Returns:
            (N,) float32; see `perception.similarity.relevancy`.

        Raises:
            InvalidTextError: If a text is empty or too long.
        """
        wanted = self.encode_ensemble(text)
        negatives = [self.encode_ensemble(prompt) for prompt in self.negative_prompts]
        others = [self.encode_ensemble(other) for other in unwanted]
        return relevancy(features, wanted, negatives, others, sharpness=self.sharpness)

    def encode_ensemble(self, text: str) -> TextFeatures:
        """Encode a text under all wordings.

        Args:
            text: Any text with at least one word.

        Returns:
            The mean of the pooled features, unit length, and the tokens under the first wording.

        Raises:
            InvalidTextError: If the text is empty or too long.
        """
        check_length(text)
        checked_text(text)  # a wording would hide that there are no words
        found = [self.encode(prompt.replace("{}", text)) for prompt in self.prompts]
        if len(found) == 1:
            return found[0]
        mean = np.mean([features.pooled for features in found], axis=0)
        mean /= np.linalg.norm(mean)
        return TextFeatures(pooled=mean.astype(np.float32), tokens=found[0].tokens)


def check_length(text: str) -> None:
    """Refuse a text that CLIP would cut off silently.

    The count is CLIP's whatever the encoder, so that a text is not good for one and bad for
    another.

    Args:
        text: The text.

    Raises:
        InvalidTextError: If it has more than `MAX_TEXT_TOKENS` tokens.
    """
    if len(text) <= MAX_TEXT_TOKENS - 2:
        return  # a token has at least one character
    from open_clip.tokenizer import SimpleTokenizer

    num_tokens = len(SimpleTokenizer().encode(text)) + 2
    if num_tokens > MAX_TEXT_TOKENS:
        raise InvalidTextError(
            f"Text {text[:30] + '...'!r} has {num_tokens} tokens; expected at most "
            f"{MAX_TEXT_TOKENS}. Say it in fewer words."
        )
