"""A²: one stage of alignment between candidates and a cloud weighted by its similarity."""

import math
from dataclasses import dataclass
from typing import ClassVar

from jaxtyping import Float
from torch import Tensor, nn

from policy.baselines.heads import BaselineConfig, CandidateScores, CandidateTokens
from policy.baselines.rotary import NUM_AXES, RotaryAttention
from policy.errors import InvalidConfigError
from policy.learnt import LearntPolicy
from policy.network.alignment import scaled_similarity
from policy.network.base import CandidateNetwork
from policy.network.batch import DecisionBatch
from policy.network.decoder import NetworkOutput
from policy.network.encoding import fourier_features, mlp, num_fourier_features


@dataclass(frozen=True, kw_only=True)
class A2Config(BaselineConfig):
    """Architecture of the A² network.

    Attributes:
        num_layers: Layers of cross-attention; one, as in the original.
        local_heads: Start half of the heads looking at what is at the candidate, as stage 2 of the
            SR network does. Not in the original.

    Raises:
        InvalidConfigError: If a value is out of range or contradicts another one.
    """

    kind: ClassVar[str] = "a2"

    num_layers: int = 1
    local_heads: bool = True

    def __post_init__(self) -> None:
        """Check ranges and combinations."""
        super().__post_init__()
        self._check_positive("num_layers")
        if self.head_dim < 2 * NUM_AXES:
            raise InvalidConfigError(
                f"width: got {self.width}, expected at least {2 * NUM_AXES * self.num_heads}: "
                f"rotary positions take {2 * NUM_AXES} channels of each of the "
                f"{self.num_heads} heads."
            )


class CrossLayer(nn.Module):
    """Candidates ask the points, then think; a residual around either."""

    def __init__(self, config: A2Config) -> None:
        """Make the layer.

        Args:
            config: Size of the network.
        """
        super().__init__()
        width = config.width
        self.query_norm = nn.LayerNorm(width)
        self.key_norm = nn.LayerNorm(width)
        self.attention = RotaryAttention(width, config.num_heads, local_heads=config.local_heads)
        self.feed_forward_norm = nn.LayerNorm(width)
        self.feed_forward = mlp(width, 4 * width, width)

    def forward(
        self,
        states: Float[Tensor, "batch candidates width"],
        keys: Float[Tensor, "batch points width"],
        values: Float[Tensor, "batch points width"],
        batch: DecisionBatch,
    ) -> Float[Tensor, "batch candidates width"]:
        """Let the candidates ask once.

        Args:
            states: One state a candidate.
            keys: What the points are found by.
            values: What they hold.
            batch: B decisions.

        Returns:
            States that know more.
        """
        weights = self.attention.weights(
            self.query_norm(states),
            batch.poses[..., :3],
            self.key_norm(keys),
            batch.positions,
            batch.point_mask,
        )
        # Departure: the original normalises its values too, and so divides the similarity out.
        states = states + self.attention.gather(weights, values)
        return states + self.feed_forward(self.feed_forward_norm(states))


class A2Network(CandidateNetwork):
    """Single-stage alignment, after "Efficient Alignment of Unconditioned Action Prior" (A²).

    Values are the points' features times their similarity to the phrase: all that the network gets
    of the language. Keys are the points' positions, queries the candidates' poses. There is no mask
    of stage 1 and no exchange among the points. Against the original:

    - Queries are turned by the candidates' positions as keys are by the points', so that scores
      depend on what lies between them; the original turns keys and values, and no query.
    - Wavelengths fit the workspace; those of the original go up from 6 m.
    - Similarity is scaled to 0 to 1 within a cloud; encoders differ in the range that they use.
    - Points are those that the SR network sees; `point_selection="similar"` has the original's.
    """

    config_type: ClassVar[type[A2Config]] = A2Config
    config: A2Config

    def __init__(self, config: A2Config) -> None:
        """Make a network with random weights.

        Args:
            config: Size and variant.
        """
        super().__init__()
        self.config = config
        width = config.width
        self.candidates = CandidateTokens(config)
        self.positions = mlp(num_fourier_features(config.num_fourier_bands), width, width, width)
        self.visual = nn.Linear(config.feature_dim, width)
        self.layers = nn.ModuleList(CrossLayer(config) for _ in range(config.num_layers))
        self.norm = nn.LayerNorm(width)
        self.scores = CandidateScores(config)

    def forward(self, batch: DecisionBatch) -> NetworkOutput:
        """Score the candidates of a batch of decisions.

        Args:
            batch: B decisions, padded to N points and K candidates.

        Returns:
            Scores (B, K), minus infinity on padding, and the decoded action parameters.
        """
        keys = self.positions(fourier_features(batch.positions, self.config.num_fourier_bands))
        values = self.visual(self.weighted_features(batch))
        states = self.candidates(batch)
        for layer in self.layers:
            states = layer(states, keys, values, batch)
        return self.scores(self.norm(states), self.candidates.known_phase(batch), batch)

    def weighted_features(self, batch: DecisionBatch) -> Float[Tensor, "batch points channels"]:
        """Features times similarity.

        Args:
            batch: B decisions.

        Returns:
            One row a point. Channels of a unit row are small; they are brought to about 1.
        """
        similarity = scaled_similarity(batch.similarity, batch.point_mask)
        return batch.features * similarity[..., None] * math.sqrt(self.config.feature_dim)


class A2Policy(LearntPolicy[A2Network]):
    """Scores candidates with a trained A² network."""

    name = "a2"
    variant = "a2"
    network_type = A2Network
