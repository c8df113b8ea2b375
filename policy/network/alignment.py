"""The two alignment stages (section 3.3.1): language to vision, action to vision."""

import math

import torch
from jaxtyping import Bool, Float
from torch import Tensor, nn

from policy.network.attention import (
    MultiHeadAttention,
    masked_softmax,
    merge_heads,
    scaled_scores,
    split_heads,
)
from policy.network.config import SRConfig
from policy.network.encoding import fourier_features, mlp, num_fourier_features

# Score that a cosine similarity of 1 starts with in the semantic mask. CLIP's own temperature
# would be 100, a mask of a few points; 10 lets the usual spread of similarities in a cloud, 0.1,
# change a point's weight by e.
_INITIAL_SHARPNESS = 10.0
# Advantage of the pooled embedding over a token in the mask at the start: about half of all
# weight in an instruction of seven tokens.
_INITIAL_POOLED_ADVANTAGE = 2.0


class LanguageAlignment(nn.Module):
    """Stage 1 (1-Align): the instruction gates the points, head by head.

    Eq. (5) as printed turns T language queries into T rows, while eq. (6) and the DSSA need one
    row a point. We read the attention of the language on the points as the "semantic mask" that
    the text calls it: it gates the values where they are.
    """

    def __init__(self, config: SRConfig) -> None:
        """Make the stage.

        Args:
            config: Size of the network.
        """
        super().__init__()
        width, feature_dim = config.width, config.feature_dim
        self.num_heads = config.num_heads
        self.query = nn.Linear(feature_dim, width)
        self.key = nn.Linear(feature_dim, width, bias=False)
        self.token_weight = nn.Linear(feature_dim, config.num_heads, bias=False)
        self.pooled_advantage = nn.Parameter(
            torch.full((config.num_heads,), _INITIAL_POOLED_ADVANTAGE)
        )
        self.value = nn.Linear(width, width)
        self.out = nn.Linear(width, width)
        self.norm = nn.LayerNorm(width)
        self._start_from_cosine_similarity(config)

    def _start_from_cosine_similarity(self, config: SRConfig) -> None:
        # Image and text features share a space in which the cosine is the similarity, and that
        # holds for objects never trained on. Equal (semi-)orthogonal projections keep it:
        # E[(Wt)·(Wf)]/√d = gain² · (d/C) · cos/√d for each head. Independent random projections
        # would throw it away, and default gains leave the scores of unit rows near zero.
        nn.init.orthogonal_(self.query.weight)
        row_norm_sq = self.query.weight.detach().square().sum() / config.feature_dim
        gain_sq = _INITIAL_SHARPNESS * math.sqrt(config.head_dim) * config.num_heads / row_norm_sq
        with torch.no_grad():
            self.query.weight.mul_(gain_sq.sqrt())
            self.key.weight.copy_(self.query.weight)
        nn.init.zeros_(self.query.bias)
        nn.init.zeros_(self.token_weight.weight)

    def gate(
        self,
        features: Float[Tensor, "batch points channels"],
        point_mask: Bool[Tensor, "batch points"],
        tokens: Float[Tensor, "batch tokens channels"],
        token_mask: Bool[Tensor, "batch tokens"],
        pooled: Float[Tensor, "batch channels"],
    ) -> Float[Tensor, "batch heads points"]:
        """The semantic mask.

        Args:
            features: Visual features of the points.
            point_mask: True for real points.
            tokens: Features of the instruction's tokens.
            token_mask: True for real tokens.
            pooled: Feature of the whole instruction. It joins the tokens as one more, because in
                CLIP it alone was trained to lie near image features.

        Returns:
            A gate for each head and point, of mean 1 over the real points and 0 on padding.
        """
        language = torch.cat([tokens, pooled[:, None]], dim=1)
        language_mask = nn.functional.pad(token_mask, (0, 1), value=True)
        q = split_heads(self.query(language), self.num_heads)
        k = split_heads(self.key(features), self.num_heads)
        attention = masked_softmax(scaled_scores(q, k), point_mask[:, None, None])  # eq. (4)
        token_scores = self.token_weight(language).transpose(1, 2)
        is_pooled = torch.arange(language.shape[1], device=language.device) == tokens.shape[1]
        token_scores = token_scores + self.pooled_advantage[:, None] * is_pooled
        weights = masked_softmax(token_scores, language_mask[:, None])
        num_points = point_mask.sum(dim=-1)[:, None, None]
        # Each row of the attention sums to 1, so the number of points makes the mean 1.
        return (weights[:, :, None] @ attention).squeeze(2) * num_points

    def forward(
        self,
        x: Float[Tensor, "batch points width"],
        gate: Float[Tensor, "batch heads points"],
    ) -> Float[Tensor, "batch points width"]:
        """Gate the points' values.

        Args:
            x: Point features, projected to the network's width.
            gate: From `gate`.

        Returns:
            V_align, one row a point.
        """
        values = split_heads(self.value(x), self.num_heads)
        # Eq. (5) read as a mask: V_align,i = gate_i · V_i, and a residual.
        return self.norm(x + self.out(merge_heads(values * gate[..., None])))


class ActionAlignment(nn.Module):
    """Stage 2 (2-Align): every candidate gathers what the points around it mean (eq. 6)."""

    def __init__(self, config: SRConfig) -> None:
        """Make the stage.

        Args:
            config: Size of the network.
        """
        super().__init__()
        self.num_bands = config.num_fourier_bands
        self.query_fourier = config.query_fourier
        num_fourier = num_fourier_features(self.num_bands)
        width = config.width
        query_in = 7 + (num_fourier if self.query_fourier else 0)
        self.query_mlp = mlp(query_in, width, width, width)
        self.phase = nn.Embedding(2, width)
        self.key_mlp = mlp(config.feature_dim + num_fourier, width, width)
        self.attention = MultiHeadAttention(width, config.num_heads)
        self.norm = nn.LayerNorm(width)

    def forward(
        self,
        poses: Float[Tensor, "batch candidates 7"],
        phase: Tensor,
        positions: Float[Tensor, "batch points 3"],
        features: Float[Tensor, "batch points channels"],
        values: Float[Tensor, "batch points width"],
        point_mask: Bool[Tensor, "batch points"],
    ) -> Float[Tensor, "batch candidates width"]:
        """Align candidates with the cloud.

        Args:
            poses: Candidates: normalised position and quaternion x, y, z, w.
            phase: (batch,) 0 for pick, 1 for place.
            positions: Normalised positions of the points.
            features: Visual features of the points, as they came.
            values: V_align, what stage 1 made of them.
            point_mask: True for real points.

        Returns:
            A state for each candidate.
        """
        pose_inputs = poses
        if self.query_fourier:
            # Departure from 3.3.1, which embeds the seven numbers alone: attention compares a
            # candidate's position with those of the points, and a product of the same waves on
            # both sides is a function of their difference; an MLP would first have to learn them.
            waves = fourier_features(poses[..., :3], self.num_bands)
            pose_inputs = torch.cat([poses, waves], dim=-1)
        queries = self.query_mlp(pose_inputs) + self.phase(phase)[:, None]
        visual_position = torch.cat([features, fourier_features(positions, self.num_bands)], dim=-1)
        keys = self.key_mlp(visual_position)
        aligned = self.attention(queries, keys, values, point_mask)  # eq. (6)
        return self.norm(queries + aligned)
