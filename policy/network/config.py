"""Size and variants of the SR network."""

from dataclasses import dataclass
from typing import Literal, get_args

from policy.errors import InvalidConfigError

Sparsifier = Literal["relu2", "relu", "softmax"]
SelfAttention = Literal["diagonal", "full"]
PointSelection = Literal["balanced", "similar"]
Ablation = Literal["base", "sr_a", "sr"]


@dataclass(frozen=True, kw_only=True)
class SRConfig:
    """Architecture of the network; stored beside its weights.

    Attributes:
        feature_dim: Channels C of the visual and text features.
        width: Width D of the network; 512 as in section 3.3.1 (A2 uses 768).
        num_heads: Attention heads.
        one_align: Stage 1, language to vision. Without it (BASE), stage 2 works on the visual
            features themselves.
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
        num_bias_scales: Scales of the relative position bias.
        max_points: Points taken from a cloud of 1500-3000; attention is quadratic in them.
        point_selection: "balanced": half by similarity, half spread evenly. "similar": the most
            similar ones only, as A2 does.
        max_opening_m: Largest finger opening that can be read out, metres.
        max_refinement_rad: Largest correction of the orientation that can be read out: the
            candidate was checked for collisions as it stands, so only a small one is safe.

    Raises:
        InvalidConfigError: If a value is out of range or contradicts another one.
    """

    feature_dim: int
    width: int = 512
    num_heads: int = 8
    one_align: bool = True
    dssa: bool = True
    num_dssa_layers: int = 2
    sparsifier: Sparsifier = "relu2"
    num_encoder_layers: int = 1
    self_attention: SelfAttention = "diagonal"
    query_fourier: bool = True
    num_fourier_bands: int = 6
    num_bias_scales: int = 6
    max_points: int = 512
    point_selection: PointSelection = "balanced"
    max_opening_m: float = 0.085
    max_refinement_rad: float = 0.2

    def __post_init__(self) -> None:
        """Check ranges and combinations."""
        for name in (
            "feature_dim",
            "width",
            "num_heads",
            "num_dssa_layers",
            "num_fourier_bands",
            "num_bias_scales",
            "max_points",
            "max_opening_m",
            "max_refinement_rad",
        ):
            if getattr(self, name) <= 0:
                raise InvalidConfigError(f"{name}: got {getattr(self, name)}, expected above 0.")
        if self.num_encoder_layers < 0:
            raise InvalidConfigError(
                f"num_encoder_layers: got {self.num_encoder_layers}, expected at least 0."
            )
        if self.width % self.num_heads:
            raise InvalidConfigError(
                f"width: got {self.width}, expected a multiple of num_heads={self.num_heads}."
            )
        for name, choices in (
            ("sparsifier", get_args(Sparsifier)),
            ("self_attention", get_args(SelfAttention)),
            ("point_selection", get_args(PointSelection)),
        ):
            if getattr(self, name) not in choices:
                raise InvalidConfigError(
                    f"{name}: got {getattr(self, name)!r}, expected one of {', '.join(choices)}."
                )
        if self.dssa and not self.one_align:
            raise InvalidConfigError(
                "dssa: got True with one_align=False, expected dssa=False: DSSA refines what "
                "stage 1 puts out."
            )

    @property
    def head_dim(self) -> int:
        """Channels d of one head."""
        return self.width // self.num_heads


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
        "base": {"one_align": False, "dssa": False},
        "sr_a": {"one_align": True, "dssa": False},
        "sr": {"one_align": True, "dssa": True},
    }
    if name not in switches:
        raise InvalidConfigError(f"ablation: got {name!r}, expected one of {', '.join(switches)}.")
    return switches[name]
