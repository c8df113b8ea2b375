"""The SR network: from a padded batch of decisions to scores of the candidates."""

from dataclasses import replace
from typing import ClassVar

import torch
from jaxtyping import Bool, Float
from torch import Tensor, nn

from policy.network.alignment import (
    ActionAlignment,
    LanguageAlignment,
    PointwiseLanguageAttention,
    scaled_similarity,
)
from policy.network.base import CandidateNetwork
from policy.network.batch import DecisionBatch
from policy.network.bias import candidate_basis, position_basis
from policy.network.config import SRConfig
from policy.network.decoder import ActionDecoder, NetworkOutput
from policy.network.dssa import DSSALayer
from policy.network.encoder import EncoderLayer
from policy.network.encoding import fourier_features, num_fourier_features
from policy.network.evidence import CandidateEvidence, Evidence, mask_nearness
from policy.network.morton import morton_order


class SRNetwork(CandidateNetwork):
    """Two-stage cross-modal alignment with dense-sparse self-attention (section 3.3).

    Stage 1 gates the cloud by the instruction, DSSA lets the points exchange information, stage 2
    lets every candidate gather from the points, and the decoder scores the candidates. Scores do
    not depend on the order of the points, nor on padding, and follow the order of the candidates.
    """

    config_type: ClassVar[type[SRConfig]] = SRConfig
    config: SRConfig

    def __init__(self, config: SRConfig) -> None:
        """Make a network with random weights.

        Args:
            config: Size and variant.
        """
        super().__init__()
        self.config = config
        width, num_heads = config.width, config.num_heads
        self.visual = nn.Linear(config.feature_dim, width)
        self.language_alignment = _stage_1(config)
        self.dssa_layers = nn.ModuleList(
            DSSALayer(width, num_heads, config.num_bias_scales, config.sparsifier)
            for _ in range(config.num_dssa_layers if config.dssa else 0)
        )
        self.action_alignment = ActionAlignment(config)
        self.position = nn.Linear(num_fourier_features(config.num_fourier_bands), width)
        self.encoder_layers = nn.ModuleList(
            EncoderLayer(width, num_heads, config.self_attention)
            for _ in range(config.num_encoder_layers)
        )
        self.decoder = ActionDecoder(config)
        self.evidence = CandidateEvidence(config)

    def forward(self, batch: DecisionBatch) -> NetworkOutput:
        """Score the candidates of a batch of decisions.

        Args:
            batch: B decisions, padded to N points, T tokens and K candidates.

        Returns:
            Scores (B, K), minus infinity on padding, and the decoded action parameters.
        """
        if self.config.dssa:
            # The convolution of eq. (9) needs rows and columns whose neighbours are neighbours in
            # space; the paper names no order.
            batch = batch.take_points(morton_order(batch.positions, batch.point_mask))
        phase = batch.phase if self.config.side else batch.phase.clamp(max=1)
        mask = self.semantic_mask(batch)
        num_scales = self.config.num_bias_scales
        basis = candidate_basis(batch.poses, batch.positions, phase > 0, num_scales)
        values = self._values(batch, mask)
        states, readout = self.action_alignment(batch, phase, values, mask, basis)
        waves = fourier_features(batch.poses[..., :3], self.config.num_fourier_bands)
        states = states + self.position(waves)
        for layer in self.encoder_layers:
            states = layer(states, batch.candidate_mask)
        output = self.decoder(states)
        nearness = mask_nearness(basis[:, :num_scales], mask) if self.config.mask_nearness else None
        evidence = Evidence(prior=batch.prior, readout=readout, nearness=nearness)
        logits = output.logits + self.evidence(phase, evidence)
        return replace(output, logits=logits.masked_fill(~batch.candidate_mask, float("-inf")))

    def semantic_mask(self, batch: DecisionBatch) -> Float[Tensor, "batch heads points"]:
        """How much each point matters to the instruction.

        Args:
            batch: Decisions.

        Returns:
            The mask of stage 1, of mean 1 over the real points and 0 on padding. Without stage 1,
            or where its points ask, the points' similarity, scaled alike, for every head.
        """
        if isinstance(self.language_alignment, LanguageAlignment):
            return self.language_alignment.gate(batch)
        relevance = _relevance(batch.similarity, batch.point_mask)
        return relevance[:, None].expand(-1, self.config.num_heads, -1)

    @property
    def masking(self) -> nn.Module | None:
        """Stage 1, if it makes a mask."""
        stage = self.language_alignment
        return stage if isinstance(stage, LanguageAlignment) else None

    def alpha(self) -> Float[Tensor, "layers 2"]:
        """Weights of the sparse and the dense branch of every DSSA layer (eq. 12)."""
        rows = [layer.alpha for layer in self.dssa_layers if isinstance(layer, DSSALayer)]
        return torch.stack(rows) if rows else torch.zeros(0, 2)

    def _values(
        self, batch: DecisionBatch, mask: Float[Tensor, "batch heads points"]
    ) -> Float[Tensor, "batch points width"]:
        """V_align of eq. (6)."""
        x = self.visual(batch.features)
        if isinstance(self.language_alignment, LanguageAlignment):
            x = self.language_alignment(x, mask)
        elif self.language_alignment is not None:
            x = self.language_alignment(x, batch)
        else:
            # BASE has no language of its own, so its scores could not depend on the instruction.
            # Its points are weighted by their similarity, the product that A2 uses.
            return x * mask[:, 0, :, None]
        if self.dssa_layers:
            basis = position_basis(batch.positions, self.config.num_bias_scales)
            if torch.is_autocast_enabled(basis.device.type):
                # Once, and not again in every layer.
                basis = basis.to(torch.get_autocast_dtype(basis.device.type))
            for layer in self.dssa_layers:
                x = layer(x, basis, batch.point_mask)
        return x


def _stage_1(config: SRConfig) -> LanguageAlignment | PointwiseLanguageAttention | None:
    if not config.one_align:
        return None
    if config.language_attention == "points":
        return PointwiseLanguageAttention(config)
    return LanguageAlignment(config)


def _relevance(
    similarity: Float[Tensor, "batch points"], mask: Bool[Tensor, "batch points"]
) -> Float[Tensor, "batch points"]:
    """Similarity shifted to a minimum of 0 and scaled to a mean of 1 over the real points."""
    scaled = scaled_similarity(similarity, mask)
    mean = scaled.sum(dim=-1, keepdim=True) / mask.sum(dim=-1, keepdim=True).clamp(min=1)
    return scaled / mean.clamp(min=1e-6)
