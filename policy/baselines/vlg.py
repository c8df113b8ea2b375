"""VLG: objects, candidates and words look at one another, and the candidates are scored."""

import math
from dataclasses import dataclass
from typing import ClassVar

import torch
from jaxtyping import Bool, Float
from torch import Tensor, nn

from policy.baselines.heads import BaselineConfig, CandidateScores, CandidateTokens
from policy.errors import InvalidArrayError
from policy.learnt import LearntPolicy
from policy.network.alignment import scaled_similarity
from policy.network.attention import MultiHeadAttention
from policy.network.base import CandidateNetwork
from policy.network.batch import DecisionBatch
from policy.network.bias import RelativePositionBias, bias_scales, position_basis
from policy.network.decoder import NetworkOutput
from policy.network.encoding import fourier_features, mlp, num_fourier_features
from policy.network.objects import ObjectBatch

# Score at the start of a token at the same place over one elsewhere, in the heads that begin
# local, and the scale of that in normalised units: 4 cm in the standard workspace, half an object.
_LOCAL_STRENGTH = 8.0
_LOCAL_SCALE = 0.2


@dataclass(frozen=True, kw_only=True)
class VLGConfig(BaselineConfig):
    """Architecture of the VLG network.

    Attributes:
        num_layers: Layers of joint attention.
        phrase: Tell the network the phrase that is looked for besides the sentence; it also takes
            the place of the sentence in the product with the objects' features.
        local_heads: Start half of the heads looking at what is near, as stage 2 of the SR network
            does. Not in the original.
        num_bias_scales: Scales of the relative position bias.

    Raises:
        InvalidConfigError: If a value is out of range or contradicts another one.
    """

    kind: ClassVar[str] = "vlg"
    uses_objects: ClassVar[bool] = True

    num_layers: int = 2
    phrase: bool = True
    local_heads: bool = True
    num_bias_scales: int = 6

    def __post_init__(self) -> None:
        """Check the ranges."""
        super().__post_init__()
        self._check_positive("num_layers", "num_bias_scales")


class ObjectTokens(nn.Module):
    """What an object looks like, how well that fits what is asked for, its place and its size."""

    def __init__(self, config: VLGConfig) -> None:
        """Make the layers.

        Args:
            config: Size of the network.
        """
        super().__init__()
        width, self.num_bands = config.width, config.num_fourier_bands
        self.looks = nn.Linear(config.feature_dim, width)
        self.product = nn.Linear(config.feature_dim, width, bias=False)
        # Not one more input of the MLP, where it would be one number among forty.
        self.similarity = nn.Linear(1, width, bias=False)
        self.place = mlp(num_fourier_features(self.num_bands) + 3, width, width)

    def forward(
        self, objects: ObjectBatch, text: Float[Tensor, "batch channels"]
    ) -> Float[Tensor, "batch objects width"]:
        """Embed the objects.

        Args:
            objects: Segments of B clouds.
            text: What is asked for.

        Returns:
            One row an object.
        """
        # Channels of a unit row are small; this brings them, and those of a product, to about 1.
        scale = math.sqrt(text.shape[-1])
        looks = objects.features * scale
        waves = fourier_features(objects.positions, self.num_bands)
        similarity = scaled_similarity(objects.similarity, objects.mask)[..., None]
        place = self.place(torch.cat([waves, objects.sizes], dim=-1))
        product = self.product(looks * (text * scale)[:, None])
        return self.looks(looks) + product + self.similarity(similarity) + place


class JointLayer(nn.Module):
    """Every token looks at all others, then thinks; a residual around either."""

    def __init__(self, config: VLGConfig) -> None:
        """Make the layer.

        Args:
            config: Size of the network.
        """
        super().__init__()
        width, num_heads = config.width, config.num_heads
        self.norm = nn.LayerNorm(width)
        self.attention = MultiHeadAttention(width, num_heads)
        self.bias = RelativePositionBias(num_heads, config.num_bias_scales)
        self.feed_forward_norm = nn.LayerNorm(width)
        self.feed_forward = mlp(width, 4 * width, width)
        if config.local_heads:
            scales = bias_scales(config.num_bias_scales)
            nearest = min(range(len(scales)), key=lambda i: abs(math.log(scales[i] / _LOCAL_SCALE)))
            with torch.no_grad():
                self.bias.weight[: num_heads // 2, nearest] = _LOCAL_STRENGTH

    def forward(
        self,
        tokens: Float[Tensor, "batch tokens width"],
        basis: Float[Tensor, "batch basis tokens tokens"],
        mask: Bool[Tensor, "batch tokens"],
    ) -> Float[Tensor, "batch tokens width"]:
        """Let the tokens exchange information.

        Args:
            tokens: Candidates, objects and words.
            basis: Functions of their distances.
            mask: True for real tokens.

        Returns:
            Tokens that know more.
        """
        x = self.norm(tokens)
        weights = self.attention.weights(x, x, mask, self.bias(basis))
        tokens = tokens + self.attention.gather(weights, x)
        return tokens + self.feed_forward(self.feed_forward_norm(tokens))


class VLGNetwork(CandidateNetwork):
    """Object-centric joint attention, after "A Joint Modeling of Vision-Language-Action" (VLG).

    Instead of points there are objects: segments of the cloud, each with its mean feature. Against
    the original:

    - Objects are segments of the cloud by its shape, instead of boxes of a detector in an image.
    - Attention is joint, over objects, candidates and words; in the original candidates ask the
      objects, and all that it has of the text is the product with the objects' features.
    - It is trained by imitation like every network here, and not by reinforcement.
    """

    config_type: ClassVar[type[VLGConfig]] = VLGConfig
    config: VLGConfig

    def __init__(self, config: VLGConfig) -> None:
        """Make a network with random weights.

        Args:
            config: Size and variant.
        """
        super().__init__()
        self.config = config
        self.objects = ObjectTokens(config)
        self.candidates = CandidateTokens(config)
        self.language = nn.Linear(config.feature_dim, config.width)
        # Candidates, objects, words of the sentence, the sentence, the phrase.
        self.sort = nn.Embedding(4 + config.phrase, config.width)
        self.layers = nn.ModuleList(JointLayer(config) for _ in range(config.num_layers))
        self.norm = nn.LayerNorm(config.width)
        self.scores = CandidateScores(config)

    def forward(self, batch: DecisionBatch) -> NetworkOutput:
        """Score the candidates of a batch of decisions.

        Args:
            batch: B decisions with their objects, padded to S objects and K candidates.

        Returns:
            Scores (B, K), minus infinity on padding, and the decoded action parameters.

        Raises:
            InvalidArrayError: If the batch has no objects.
        """
        objects = batch.objects
        if objects is None:
            raise InvalidArrayError(
                "objects: got a batch without, expected one made with the network's own "
                "configuration, whose samples have them."
            )
        text = batch.phrase if self.config.phrase else batch.pooled
        pooled = torch.stack([batch.pooled, batch.phrase][: 1 + self.config.phrase], dim=1)
        groups = [
            self.candidates(batch),
            self.objects(objects, text),
            self.language(batch.tokens),
            self.language(pooled),
        ]
        tokens = torch.cat(groups, dim=1) + self.sort(self._sorts(groups))
        ones = torch.ones(pooled.shape[:2], dtype=torch.bool, device=pooled.device)
        mask = torch.cat([batch.candidate_mask, objects.mask, batch.token_mask, ones], dim=1)
        basis = self._basis(batch.poses[..., :3], objects.positions, tokens.shape[1])
        for layer in self.layers:
            tokens = layer(tokens, basis, mask)
        states = self.norm(tokens[:, : batch.poses.shape[1]])
        return self.scores(states, self.candidates.known_phase(batch), batch)

    def _sorts(self, groups: list[Tensor]) -> Tensor:
        """What sort each token is of: candidates, objects, words, then each pooled text."""
        sizes = [group.shape[1] for group in groups[:-1]] + [1] * groups[-1].shape[1]
        device = groups[0].device
        return torch.arange(len(sizes), device=device).repeat_interleave(
            torch.tensor(sizes, device=device)
        )

    def _basis(
        self,
        candidates: Float[Tensor, "batch candidates 3"],
        objects: Float[Tensor, "batch objects 3"],
        num_tokens: int,
    ) -> Float[Tensor, "batch basis tokens tokens"]:
        """Functions of the distances between tokens; 0 from and to words, which are nowhere."""
        positions = torch.cat([candidates, objects], dim=1)
        basis = position_basis(positions, self.config.num_bias_scales)
        num_words = num_tokens - positions.shape[1]
        return nn.functional.pad(basis, (0, num_words, 0, num_words))


class VLGPolicy(LearntPolicy[VLGNetwork]):
    """Scores candidates with a trained VLG network."""

    name = "vlg"
    variant = "vlg"
    network_type = VLGNetwork
