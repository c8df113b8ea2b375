"""Text towers of open_clip: the pooled embedding, and every token in the same space."""

from typing import Protocol, cast

import torch.nn.functional as F
from open_clip.model import CLIP, CustomTextCLIP
from open_clip.transformer import TextTransformer
from torch import Tensor, nn

from perception.encoders.base import TextFeatures
from perception.errors import UnsupportedEncoderError


class TextTower(Protocol):
    """A tower whose tokens can be projected into the text space."""

    feature_dim: int

    def read(self, ids: Tensor) -> TextFeatures:
        """Encode one text.

        Args:
            ids: (1, context) token numbers, padded.

        Returns:
            Its features; tokens reach to the end token.
        """
        ...


def text_tower(model: nn.Module, name: str) -> TextTower:
    """Find out how the text tower of a model is to be read.

    Args:
        model: A model of open_clip in evaluation mode.
        name: Its name, for messages.

    Returns:
        The tower.

    Raises:
        UnsupportedEncoderError: If its tokens do not live in the text space.
    """
    if type(model) is CLIP:
        return _ClipText(model)
    if type(model) is CustomTextCLIP and isinstance(model.text, TextTransformer):
        return _TransformerText(model.text)
    kind = type(getattr(model, "text", model)).__name__
    raise UnsupportedEncoderError(
        f"{name} has a text tower {kind}, whose tokens have no projection into text space. "
        "Supported: text transformers of open_clip's CLIP and CustomTextCLIP models."
    )


class _ClipText:
    """The text half of `open_clip.CLIP`, which is no module of its own."""

    def __init__(self, model: CLIP) -> None:
        self._model = model
        self._projection = cast(Tensor, model.text_projection)
        self.feature_dim = int(self._projection.shape[1])

    def read(self, ids: Tensor) -> TextFeatures:
        end = int(ids[0].argmax())  # the end token has the highest number of all
        model = self._model
        x = model.get_submodule("token_embedding")(ids) + model.positional_embedding
        x = model.get_submodule("transformer")(x, attn_mask=model.attn_mask)
        projected = (model.get_submodule("ln_final")(x) @ self._projection)[0]
        return TextFeatures(
            pooled=F.normalize(projected[end], dim=0).numpy(), tokens=projected[: end + 1].numpy()
        )


class _TransformerText:
    """`TextTransformer`, SigLIP's for instance."""

    def __init__(self, text: TextTransformer) -> None:
        self._text = text
        self.feature_dim = cast(int, text.output_dim)

    def read(self, ids: Tensor) -> TextFeatures:
        text = self._text
        x, mask = text._embeds(ids)
        x = text.ln_final(text.transformer(x, attn_mask=mask))
        projection = text.text_projection
        if isinstance(projection, nn.Linear):
            x = projection(x)
        elif projection is not None:
            x = x @ projection
        # Padding repeats one number to the end; its first place ends the text.
        row = ids[0]
        is_other = (row != row[-1]).nonzero()
        end = int(is_other[-1]) + 1 if len(is_other) else 0
        pooled = F.normalize(text(ids), dim=-1)[0]
        return TextFeatures(pooled=pooled.numpy(), tokens=x[0, : end + 1].numpy())
