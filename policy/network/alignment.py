"""The two alignment stages (section 3.3.1): language to vision, action to vision."""

import math

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor, nn

from policy.network.attention import MultiHeadAttention, masked_softmax, scaled_scores
from policy.network.batch import PHASES, DecisionBatch
from policy.network.bias import CandidateBias
from policy.network.config import SRConfig
from policy.network.encoding import fourier_features, mlp, num_fourier_features
from policy.network.mixing import MixingModule
from policy.network.projections import merge_heads, split_heads

# Score that a cosine similarity of 1 starts with in the semantic mask. CLIP's own temperature
# would be 100; but a head sees a random part of the channels, and its cosine is off by up to 0.2.
_INITIAL_SHARPNESS = 5.0
# Advantage of a pooled embedding, of the sentence or of the phrase, over a token in the mask at
# the start: about two thirds of all weight in an instruction of seven tokens.
_INITIAL_POOLED_ADVANTAGE = 2.0
# Score at the start of the point most similar to the phrase over the least similar one: it fits
# e^8 = 3000 times as well, which the cosine adds to.
_INITIAL_SIMILARITY_SHARPNESS = 8.0


class LanguageAlignment(MixingModule):
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
        # One row for the sentence and, if it is used, one for the phrase.
        self.pooled_advantage = nn.Parameter(
            torch.full((2 if config.phrase else 1, config.num_heads), _INITIAL_POOLED_ADVANTAGE)
        )
        self.similarity_sharpness = (
            nn.Parameter(torch.full((config.num_heads,), _INITIAL_SIMILARITY_SHARPNESS))
            if config.similarity
            else None
        )
        self.value = nn.Linear(width, width)
        self.out = nn.Linear(width, width)
        self.norm = nn.LayerNorm(width)
        self._start_from_cosine_similarity(config)
        if config.frozen_projections:
            self.query.requires_grad_(False)
            self.key.requires_grad_(False)

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

    def gate(self, batch: DecisionBatch) -> Float[Tensor, "batch heads points"]:
        """The semantic mask.

        The features of the whole sentence and of the phrase join the tokens as two more, because
        in CLIP they alone were trained to lie near image features.

        Args:
            batch: Decisions; their candidates are not looked at.

        Returns:
            A gate for each head and point, of mean 1 over the real points and 0 on padding.
        """
        pooled = torch.stack([batch.pooled, batch.phrase][: len(self.pooled_advantage)], dim=1)
        language = torch.cat([batch.tokens, pooled], dim=1)
        language_mask = nn.functional.pad(batch.token_mask, (0, pooled.shape[1]), value=True)
        q = split_heads(self.query(language), self.num_heads)
        k = split_heads(self.key(batch.features), self.num_heads)
        scores = scaled_scores(q, k)
        if self.similarity_sharpness is not None:
            similarity = scaled_similarity(batch.similarity, batch.point_mask)
            scores = scores + (self.similarity_sharpness[:, None] * similarity[:, None])[:, :, None]
        attention = masked_softmax(scores, batch.point_mask[:, None, None])  # eq. (4)
        advantage = nn.functional.pad(self.pooled_advantage.T, (batch.tokens.shape[1], 0))
        token_scores = self.token_weight(language).transpose(1, 2) + advantage
        weights = masked_softmax(token_scores, language_mask[:, None])
        num_points = batch.point_mask.sum(dim=-1)[:, None, None]
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


class PointwiseLanguageAttention(nn.Module):
    """The other reading of stage 1: every point asks, and gathers from all of the language."""

    def __init__(self, config: SRConfig) -> None:
        """Make the stage.

        Args:
            config: Size of the network.
        """
        super().__init__()
        self.uses_phrase = config.phrase
        self.language = nn.Linear(config.feature_dim, config.width)
        self.attention = MultiHeadAttention(config.width, config.num_heads)
        self.norm = nn.LayerNorm(config.width)

    def forward(
        self, x: Float[Tensor, "batch points width"], batch: DecisionBatch
    ) -> Float[Tensor, "batch points width"]:
        """Add to every point what it finds in the language.

        Args:
            x: Point features, projected to the network's width.
            batch: Decisions.

        Returns:
            V_align, one row a point.
        """
        pooled = torch.stack([batch.pooled, batch.phrase][: 1 + self.uses_phrase], dim=1)
        language = self.language(torch.cat([batch.tokens, pooled], dim=1))
        mask = nn.functional.pad(batch.token_mask, (0, pooled.shape[1]), value=True)
        weights = self.attention.weights(x, language, mask)
        return self.norm(x + self.attention.gather(weights, language))


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
        self.phase = nn.Embedding(len(PHASES), width)
        self.bias = (
            CandidateBias(len(PHASES), config.num_heads, config.num_bias_scales)
            if config.candidate_bias
            else None
        )
        self.key_mlp = mlp(config.feature_dim + num_fourier, width, width)
        self.attention = MultiHeadAttention(width, config.num_heads)
        self.norm = nn.LayerNorm(width)

    def forward(
        self,
        batch: DecisionBatch,
        phase: Int[Tensor, " batch"],
        values: Float[Tensor, "batch points width"],
        mask: Float[Tensor, "batch heads points"],
        basis: Float[Tensor, "batch basis candidates points"],
    ) -> tuple[Float[Tensor, "batch candidates width"], Float[Tensor, "batch heads candidates"]]:
        """Align candidates with the cloud.

        Args:
            batch: Decisions; keys are made of their visual features as they came.
            phase: Index into `PHASES`.
            values: V_align, what stage 1 made of the points.
            mask: The semantic mask.
            basis: Where every point lies relative to every candidate, from `candidate_basis`.

        Returns:
            A state for each candidate, and what each head sees of log(1 + mask).
        """
        pose_inputs, num_bands = batch.poses, self.num_bands
        if self.query_fourier:
            # Departure from 3.3.1, which embeds the seven numbers alone: attention compares a
            # candidate's position with those of the points, and a product of the same waves on
            # both sides is a function of their difference; an MLP would first have to learn them.
            waves = fourier_features(batch.poses[..., :3], num_bands)
            pose_inputs = torch.cat([pose_inputs, waves], dim=-1)
        queries = self.query_mlp(pose_inputs) + self.phase(phase)[:, None]
        waves = fourier_features(batch.positions, num_bands)
        keys = self.key_mlp(torch.cat([batch.features, waves], dim=-1))
        bias = None if self.bias is None else self.bias(basis, phase)
        weights = self.attention.weights(queries, keys, batch.point_mask, bias)  # eq. (6)
        # A mask of mean 1 over hundreds of points reaches far beyond 1; its logarithm is close to
        # the score that made it.
        readout = (weights @ mask.log1p()[..., None].to(weights.dtype)).squeeze(-1)
        return self.norm(queries + self.attention.gather(weights, values)), readout


def scaled_similarity(
    similarity: Float[Tensor, "batch points"], mask: Bool[Tensor, "batch points"]
) -> Float[Tensor, "batch points"]:
    """Similarity scaled to span 0 to 1 over the real points; what lies on padding is finite.

    Similarities of one encoder lie within a tenth of one another, those of another fill 0 to 1.
    """
    lowest = similarity.masked_fill(~mask, float("inf")).amin(dim=-1, keepdim=True)
    highest = similarity.masked_fill(~mask, float("-inf")).amax(dim=-1, keepdim=True)
    shifted = (similarity - lowest).masked_fill(~mask, 0.0)
    return shifted / (highest - lowest).masked_fill(~mask.any(dim=-1, keepdim=True), 1.0).clamp(
        min=1e-6
    )
