"""From image classes to text space, without any training: a mixture of class-name embeddings."""

import torch
import torch.nn.functional as F
from torch import Tensor, nn


class ClassMixtureHead(nn.Module):
    """Maps image features to text space through the 1000 ImageNet classes.

    Every location is described by its class probabilities p = softmax(logits / temperature), and
    its feature is the mixture sum_c p_c (t_c - mean t), where t_c embeds the name of class c. The
    mean is removed because all names share it: without that, every location resembles every text.
    """

    def __init__(self, *, num_features: int, num_classes: int, text_dim: int) -> None:
        """Create the head with empty weights; they are loaded from a file.

        Args:
            num_features: Channels of the image features.
            num_classes: Number of classes.
            text_dim: C, dimension of the text space.
        """
        super().__init__()
        self.classifier = nn.Linear(num_features, num_classes)
        self.register_buffer("class_embeddings", torch.zeros(num_classes, text_dim))
        self.class_embeddings: Tensor

    def class_logits(self, features: Tensor) -> Tensor:
        """Classify features.

        Args:
            features: (..., num_features).

        Returns:
            (..., num_classes) logits.
        """
        return F.linear(
            features,
            self.classifier.weight.to(features.dtype),
            self.classifier.bias.to(features.dtype),
        )

    def forward(self, features: Tensor, temperature: float) -> Tensor:
        """Map features to unit vectors of the text space.

        Args:
            features: (..., num_features).
            temperature: Divides the logits; above 1 it softens the choice of class.

        Returns:
            (..., C) float32, unit length.
        """
        probabilities = torch.softmax(self.class_logits(features).float() / temperature, dim=-1)
        centered = self.class_embeddings - self.class_embeddings.mean(dim=0)
        return F.normalize(probabilities @ centered, dim=-1)
