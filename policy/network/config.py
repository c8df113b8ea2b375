"""Size and variants of the networks."""

from dataclasses import dataclass
from typing import Any, ClassVar, Literal, get_args

from policy.errors import InvalidConfigError

Sparsifier = Literal["relu2", "relu", "softmax"]
SelfAttention = Literal["diagonal", "full"]
PointSelection = Literal["balanced", "covering", "similar"]
LanguageAttention = Literal["gate", "points"]
Ablation = Literal["base", "sr_a", "sr"]


@dataclass(frozen=True, kw_only=True)
class NetworkConfig:
    """What every network over decisions has; stored beside its weights.

    Attributes:
        kind: Kind of network, as `policy.network.kinds` knows it.
        uses_objects: Whether a sample holds the segments of the cloud beside its points.
        feature_dim: Channels C of the visual and text features.
        width: Width D of the network; 512 as in section 3.3.1 (A2 uses 768).
        num_heads: Attention heads.
        max_points: Points taken from a cloud of 1500-3000; attention is quadratic in them.
        point_selection: "balanced": half by similarity, half spread evenly. "covering": both halves
            spread evenly, one over what is similar. "similar": the most similar ones only, as A2.
        max_opening_m: Largest finger opening that can be read out, metres.
        max_refinement_rad: Largest correction of the orientation that can be read out: the
            candidate was checked for collisions as it stands, so only a small one is safe.

    Raises:
        InvalidConfigError: If a value is out of range or contradicts another one.
    """

    kind: ClassVar[str]
    uses_objects: ClassVar[bool] = False

    feature_dim: int
    width: int = 512
    num_heads: int = 8
    max_points: int = 512
    point_selection: PointSelection = "balanced"
    max_opening_m: float = 0.085
    max_refinement_rad: float = 0.2

    def __post_init__(self) -> None:
        """Check ranges and combinations."""
        self._check_positive(
            "feature_dim", "width", "num_heads", "max_points", "max_opening_m", "max_refinement_rad"
        )
        self._check_choice("point_selection", PointSelection)
        if self.width % self.num_heads:
            raise InvalidConfigError(
                f"width: got {self.width}, expected a multiple of num_heads={self.num_heads}."
            )

    @property
    def head_dim(self) -> int:
        """Channels d of one head."""
        return self.width // self.num_heads

    def _check_positive(self, *names: str) -> None:
        for name in names:
            if getattr(self, name) <= 0:
                raise InvalidConfigError(f"{name}: got {getattr(self, name)}, expected above 0.")

    def _check_choice(self, name: str, choices: Any) -> None:
        if getattr(self, name) not in get_args(choices):
            raise InvalidConfigError(
                f"{name}: got {getattr(self, name)!r}, expected one of "
                f"{', '.join(get_args(choices))}."
            )


@dataclass(frozen=True, kw_only=True)
class SRConfig(NetworkConfig):
    """Architecture of the SR network.

    Attributes:
        prior: Add the candidate generator's prior to the logit, times a learnt weight. Departure:
            a pose alone does not tell whether the fingers meet the surface squarely or have room;
            the generator measured both.
        phrase: Give stage 1 the feature of the phrase that is looked for besides those of the
            sentence. Departure: it leaves out what the sentence says of the other phase.
        side: Tell the network whether a place is asked for inside or around the reference.
            Departure: the parser knows it, and few demonstrations would have to teach it.
        similarity: Give the semantic mask the points' similarity to that phrase as one more
            score. Departure: it is relative to what everything resembles, which the cosine in
            eq. (4) is not, and the zero-shot policy lives by it; so the network starts there.
        candidate_bias: Bias of stage 2 by where a point lies relative to a candidate. Departure:
            half of the heads start by looking at what is at the candidate, which content-based
            attention would have to learn from few demonstrations.
        mask_readout: Add to the logit, with learnt weights, what the heads of stage 2 see of the
            semantic mask. Departure: otherwise a whole network lies between the mask and the
            score, and only training could tell it that a large value is good. Without stage 1
            there is no mask, and the points' similarity takes its place.
        mask_nearness: Add to the logit, with learnt weights, how near the semantic mask is to a
            candidate. Departure: where nothing can be gripped at the mask, what is in the way has
            to be taken from beside it, and attention on what is at a candidate cannot tell how far
            off the mask is.
        frozen_projections: Leave the projections of language and points in stage 1 as they begin:
            equal and semi-orthogonal, so that they keep the cosines of the text space. Departure:
            what is learnt of some objects' words and features need not hold for others.
        one_align: Stage 1, language to vision. Without it (BASE), stage 2 works on the visual
            features themselves.
        language_attention: "gate": the language asks, and its attention is a mask on the points.
            "points": every point asks and gathers from the language; there is no mask, and
            `mask_readout` reads the similarity.
        dssa: Dense-sparse self-attention after stage 1. Without it, the network is SR-A.
        num_dssa_layers: DSSA layers. Section 3.3.2 speaks of layer-wise weights without a count;
            two is the least for which that means something.
        sparsifier: Activation of the sparse branch (table 4 of the paper).
        num_encoder_layers: Encoder layers L behind stage 2.
        self_attention: What a candidate attends to in the encoder. "diagonal": itself only, since
            section 3.3.1 evaluates each candidate independently; "full": all candidates.
        query_fourier: Give the action queries the Fourier features of their position that the
            keys have. Off, the query sees the bare seven numbers, as the paper writes it.
        num_fourier_bands: Octaves of the Fourier features. Six give a shortest wavelength of
            1/16 of the workspace's width, 28 mm in the standard one: about a finger's width.
        num_bias_scales: Scales of both relative position biases.

    Raises:
        InvalidConfigError: If a value is out of range or contradicts another one.
    """

    kind: ClassVar[str] = "sr"

    prior: bool = True
    phrase: bool = True
    side: bool = True
    similarity: bool = True
    candidate_bias: bool = True
    mask_readout: bool = True
    mask_nearness: bool = True
    frozen_projections: bool = False
    one_align: bool = True
    language_attention: LanguageAttention = "gate"
    dssa: bool = True
    num_dssa_layers: int = 2
    sparsifier: Sparsifier = "relu2"
    num_encoder_layers: int = 1
    self_attention: SelfAttention = "diagonal"
    query_fourier: bool = True
    num_fourier_bands: int = 6
    num_bias_scales: int = 6

    def __post_init__(self) -> None:
        """Check ranges and combinations."""
        super().__post_init__()
        self._check_positive("num_dssa_layers", "num_fourier_bands", "num_bias_scales")
        if self.num_encoder_layers < 0:
            raise InvalidConfigError(
                f"num_encoder_layers: got {self.num_encoder_layers}, expected at least 0."
            )
        self._check_choice("sparsifier", Sparsifier)
        self._check_choice("self_attention", SelfAttention)
        self._check_choice("language_attention", LanguageAttention)
        if self.frozen_projections and not (self.one_align and self.language_attention == "gate"):
            raise InvalidConfigError(
                "frozen_projections: got True without the gate of stage 1, expected "
                "one_align=True and language_attention=gate."
            )
        if self.dssa and not self.one_align:
            raise InvalidConfigError(
                "dssa: got True with one_align=False, expected dssa=False: DSSA refines what "
                "stage 1 puts out."
            )


def ablation_switches(name: Ablation) -> dict[str, bool]:
    """Switches of the paper's three variants (table 3).

    Args:
        name: "base" (stage 2 only), "sr_a" (both stages, no DSSA) or "sr" (everything).

    Returns:
        Keyword arguments for `SRConfig`.

    Raises:
        InvalidConfigError: If there is no such variant.
    """
    switches = {
        # What has no stage 1 has no mask to look at; it works on the same inputs otherwise.
        "base": {
            "one_align": False,
            "dssa": False,
            "mask_readout": False,
            "mask_nearness": False,
        },
        "sr_a": {"one_align": True, "dssa": False},
        "sr": {"one_align": True, "dssa": True},
    }
    if name not in switches:
        raise InvalidConfigError(f"ablation: got {name!r}, expected one of {', '.join(switches)}.")
    return switches[name]
