"""The trained head: cell features to text space, anchored to the class-name mixture."""

import torch
import torch.nn.functional as F
from torch import Tensor, nn

from perception.encoders.class_mixture import ClassMixtureHead
from perception.encoders.efficientnet import NUM_CELL_FEATURES, NUM_FINAL_FEATURES

NUM_HIDDEN = 768


class GroundingHead(nn.Module):
    """Maps cell features to text space: a trained projection beside `ClassMixtureHead`.

    The projection, a perceptron with one hidden layer, has learned everyday objects and their
    colours from rendered pictures. The mixture still speaks for what ImageNet knows and the
    renderings do not show; `mixture_share` is its part in the sum of the two unit vectors.
    """

    def __init__(self, *, num_classes: int, text_dim: int) -> None:
        """Create the head with random weights.

        Args:
            num_classes: Number of classes of the mixture.
            text_dim: C, dimension of the text space.
        """
        super().__init__()
        self.mixture = ClassMixtureHead(
            num_features=NUM_FINAL_FEATURES, num_classes=num_classes, text_dim=text_dim
        )
        self.hidden = nn.Linear(NUM_CELL_FEATURES, NUM_HIDDEN)
        self.projection = nn.Linear(NUM_HIDDEN, text_dim)
        self.register_buffer("mixture_share", torch.tensor(0.25))
        self.mixture_share: Tensor

    def project(self, cells: Tensor) -> Tensor:
        """Apply the trained projection alone.

        Args:
            cells: (..., NUM_CELL_FEATURES), any floating type.

        Returns:
            (..., C) float32, not normalised.
        """
        weight, bias = self.hidden.weight.to(cells.dtype), self.hidden.bias.to(cells.dtype)
        hidden = F.relu(F.linear(cells, weight, bias))
        out = F.linear(hidden, self.projection.weight.to(cells.dtype))
        return out.float() + self.projection.bias

    def forward(self, cells: Tensor, temperature: float) -> Tensor:
        """Map cell features to unit vectors of the text space.

        Args:
            cells: (..., NUM_CELL_FEATURES), any floating type.
            temperature: Softening of the class probabilities of the mixture.

        Returns:
            (..., C) float32, unit length.
        """
        share = self.mixture_share
        mixture = self.mixture(cells[..., :NUM_FINAL_FEATURES], temperature)
        trained = F.normalize(self.project(cells), dim=-1)
        return F.normalize((1 - share) * trained + share * mixture, dim=-1)
