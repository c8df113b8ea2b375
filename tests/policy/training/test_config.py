from typing import Any

import pytest

from policy.errors import InvalidConfigError
from policy.training.config import AugmentationConfig


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"epochs": 0}, "epochs: got 0, expected at least 1."),
        ({"batch": 0}, "batch: got 0, expected at least 1."),
        ({"lr": 0.0}, "lr: got 0.0, expected above 0."),
        ({"mixing_rate": -1.0}, "mixing_rate: got -1.0, expected above 0."),
        ({"val_share": 1.0}, "val_share: got 1.0, expected between 0 and 1."),
        ({"train_share": 0.0}, "train_share: got 0.0, expected above 0, at most 1."),
        ({"averaging": 1.0}, "averaging: got 1.0, expected 0 to below 1."),
        ({"device": "tpu"}, "device: got tpu, expected cpu or cuda."),
        ({"patience": -1}, "patience: got -1, expected at least 0."),
    ],
)
def test_bad_options(changes: dict[str, Any], message: str, make_train_config) -> None:
    with pytest.raises(InvalidConfigError) as caught:
        make_train_config(**changes).check()
    assert str(caught.value) == message


def test_bad_augmentation() -> None:
    with pytest.raises(InvalidConfigError) as caught:
        AugmentationConfig(rotation_deg=200.0).check()
    assert str(caught.value) == "augmentation.rotation_deg: got 200.0, expected 0 to 180."


@pytest.mark.parametrize(
    ("variant", "one_align", "dssa"),
    [("sr", True, True), ("sr_a", True, False), ("base",) + (False,) * 2],
)
def test_variants(variant: str, one_align: bool, dssa: bool, make_train_config) -> None:
    config = make_train_config(variant=variant).network_config(16)
    assert (config.one_align, config.dssa) == (one_align, dssa)
    assert (config.feature_dim, config.width, config.max_points) == (16, 32, 24)


def test_settings_of_the_network_have_their_types(make_train_config) -> None:
    settings = ("num_heads=2", "sparsifier=relu", "query_fourier=False", "max_opening_m=0.1")
    config = make_train_config(network=settings).network_config(16)
    assert (config.num_heads, config.sparsifier) == (2, "relu")
    assert config.query_fourier is False and config.max_opening_m == 0.1


@pytest.mark.parametrize(
    ("setting", "end"),
    [
        ("num_heads=two", "expected a value of type int."),
        ("query_fourier=maybe", "expected true or false."),
        ("sparsifier=hard", "expected one of relu2, relu, softmax."),
        ("heads=4", "max_points, point_selection"),
        ("num_heads", "expected NAME=VALUE with one of width, num_heads,"),
    ],
)
def test_bad_settings_of_the_network(setting: str, end: str, make_train_config) -> None:
    with pytest.raises(InvalidConfigError) as caught:
        make_train_config(network=(setting,)).network_config(16)
    assert end in str(caught.value) and "\n" not in str(caught.value)
