from typing import Any

import pytest

from policy.errors import InvalidConfigError
from policy.network.config import SRConfig, ablation_switches


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"feature_dim": 0}, "feature_dim: got 0, expected above 0."),
        ({"max_points": -1}, "max_points: got -1, expected above 0."),
        ({"num_encoder_layers": -1}, "num_encoder_layers: got -1, expected at least 0."),
        ({"width": 500}, "width: got 500, expected a multiple of num_heads=8."),
        (
            {"sparsifier": "relu3"},
            "sparsifier: got 'relu3', expected one of relu2, relu, softmax.",
        ),
        ({"self_attention": "no"}, "self_attention: got 'no', expected one of diagonal, full."),
        (
            {"point_selection": "all"},
            "point_selection: got 'all', expected one of balanced, covering, similar.",
        ),
        (
            {"language_attention": "both"},
            "language_attention: got 'both', expected one of gate, points.",
        ),
        (
            {"one_align": False},
            "dssa: got True with one_align=False, expected dssa=False: DSSA refines what stage 1 "
            "puts out.",
        ),
        *(
            (
                {"frozen_projections": True, "dssa": False} | change,
                "frozen_projections: got True without the gate of stage 1, expected "
                "one_align=True and language_attention=gate.",
            )
            for change in ({"one_align": False}, {"language_attention": "points"})
        ),
    ],
)
def test_bad_config(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidConfigError) as caught:
        SRConfig(**({"feature_dim": 768} | changes))
    assert str(caught.value) == message


def test_paper_sizes() -> None:
    config = SRConfig(feature_dim=768)
    assert (config.width, config.num_heads, config.head_dim) == (512, 8, 64)
    assert (config.sparsifier, config.num_encoder_layers) == ("relu2", 1)


@pytest.mark.parametrize("name", ["base", "sr_a", "sr"])
def test_ablations(name: Any) -> None:
    config = SRConfig(feature_dim=8, **ablation_switches(name))
    assert (config.one_align, config.dssa) == (name != "base", name == "sr")
    assert config.mask_readout == config.mask_nearness == (name != "base")
    # The same inputs for all.
    assert config.prior and config.phrase and config.side and config.similarity


def test_unknown_ablation() -> None:
    with pytest.raises(InvalidConfigError) as caught:
        ablation_switches("sr_b")  # type: ignore[arg-type]
    assert str(caught.value) == "ablation: got 'sr_b', expected one of base, sr_a, sr."
