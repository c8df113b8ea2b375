"""Options of the training, checked before anything heavy is imported."""

import dataclasses
import typing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

import tyro

from policy.errors import InvalidConfigError
from policy.network.config import NetworkConfig, ablation_switches
from policy.network.kinds import network_type

Variant = Literal["sr", "sr_a", "base", "a2", "vlg"]
Schedule = Literal["constant", "cosine"]
PickPositives = Literal["closest", "target"]
Precision = Literal["auto", "float32", "bfloat16"]
StopOn = Literal["loss", "valid", "top1"]
Cache = Literal["auto", "memory", "disk"]


@dataclass(frozen=True, kw_only=True)
class AugmentationConfig:
    """Changes of a demonstration that leave its labels true. Zeros switch them off."""

    rotation_deg: float = 180.0
    """Largest turn of cloud and candidates about the vertical through the workspace's middle. No
    instruction speaks of left or right, and the arm's base is no input."""
    jitter_m: float = 0.002
    """Standard deviation of a shift of every point along each axis: what fusion leaves of the
    cameras' noise. The noise itself is not drawn again, since images are not stored."""
    point_dropout: float = 0.2
    """Largest share of points left out; the share is drawn evenly between none and this."""
    feature_dropout: float = 0.1
    """Share of feature channels set to zero, the same for points and texts; the others grow so
    that cosines keep their size on average."""
    channel_shuffle: float = 0.0
    """Share of draws in which feature channels change places and signs, the same ones for points
    and texts. Cosines stay, but no channel means anything any more: what is learnt has to rest on
    how well texts and points agree, not on what single objects look like or are called."""
    prior_noise: float = 0.05
    """Standard deviation of an error added to the candidates' geometric quality."""
    paraphrases: float = 0.5
    """Share of draws that use a paraphrase instead of the instruction's own wording."""

    def check(self) -> None:
        """Check the ranges.

        Raises:
            InvalidConfigError: If a value is out of range.
        """
        for name, high in (
            ("rotation_deg", 180.0),
            ("jitter_m", 0.05),
            ("point_dropout", 0.9),
            ("feature_dropout", 0.9),
            ("channel_shuffle", 1.0),
            ("prior_noise", 1.0),
            ("paraphrases", 1.0),
        ):
            _check(
                f"augmentation.{name}",
                getattr(self, name),
                0 <= getattr(self, name) <= high,
                f"0 to {high:g}",
            )


@dataclass(frozen=True, kw_only=True)
class TrainConfig:
    """Options of `python -m policy.train`."""

    data: Annotated[Path, tyro.conf.arg(metavar="DIR")]
    """Folder of demonstrations, made by `python -m sr_mj.collect`."""
    out: Annotated[Path, tyro.conf.arg(metavar="DIR")]
    """Folder of the run: best.safetensors with its card, logs, and the state to resume from."""
    variant: Variant = "sr"
    """sr (both stages and DSSA), sr_a (without DSSA) or base (stage 2 only); or another network on
    the same data: a2 (one stage, features times similarity) or vlg (objects instead of points)."""
    seed: int = 0
    """Draws weights, order and augmentation. The split does not depend on it."""
    epochs: int = 200
    """Most passes over the training scenes."""
    patience: int = 20
    """Stop after so many epochs without a better validation score; 0 never stops early."""
    stop_on: StopOn = "loss"
    """Validation score that chooses the best epoch: loss (cross-entropy), valid (the same with all
    valid candidates as positives), or top1 (share of decisions whose best candidate is valid)."""
    batch: int = 32
    """Decisions a step, over all processes together."""
    lr: float = 1e-4
    """Learning rate of Adam."""
    schedule: Schedule = "constant"
    """constant, or cosine: down to zero at the last epoch."""
    warmup: int = 100
    """Steps over which the learning rate rises from zero."""
    averaging: float = 0.0
    """Decay of a running average of the weights, which is then what is validated and kept; 0 keeps
    the weights themselves."""
    clip: float = 5.0
    """Largest norm of the gradient; 0 leaves it as it is."""
    mixing_rate: float = 1.0
    """Learning rate of the weights that mix scores (of the biases, of the mask, of what is added to
    the logits, of DSSA's branches), as a multiple of --lr."""
    decoding_weight: float = 0.1
    """Weight of opening, rotation and collision flag beside the choice of the candidate."""
    pick_positives: PickPositives = "closest"
    """Right answers of a pick: closest (the grasp that was executed, as the paper has it) or target
    (every grasp that closes on the target). Of a place it is always every valid one."""
    max_candidates: int = 128
    """Candidates a decision in training: the executed one and others at random; 0 keeps all.
    Validation always keeps all."""
    val_share: float = 0.1
    """Share of scenes held out for validation, chosen by a hash of their names: more data never
    moves a scene to the other side."""
    new_share: float = 0.0
    """Share of objects held out, chosen by a hash of their names: no decision that means one of
    them is trained on, and metrics `new_...` tell how well the network chooses in these."""
    train_share: float = 1.0
    """Share of the training scenes to use, to see what more data would bring."""
    width: int | None = None
    """Width of the network; that of its configuration by default."""
    points: int | None = None
    """Points the network takes from a cloud; that of its configuration by default."""
    network: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME=VALUE")] = ()
    """Other settings of the network, such as num_dssa_layers=1 sparsifier=softmax."""
    augmentation: AugmentationConfig = field(default_factory=AugmentationConfig)
    precision: Precision = "auto"
    """Arithmetic of the network: bfloat16 (autocast) or float32; auto takes bfloat16 where the
    processor multiplies it."""
    device: str = "cpu"
    """cpu or cuda."""
    threads: int = 0
    """Threads of torch; 0 leaves that to torch."""
    cache: Cache = "auto"
    """Keep the looks in memory in half precision, or read them from disk for every draw; auto:
    memory if they take less than half of what is free."""
    save_every_s: float = 60.0
    """Seconds between saved states."""
    tensorboard: bool = True
    """Also write TensorBoard's event files, if the package is installed."""
    resume: bool = False
    """Go on where the run in --out stopped; begin if there is none."""

    def check(self) -> None:
        """Check the ranges; not on construction, where tyro would wrap the message in a box.

        Raises:
            InvalidConfigError: If a value is out of range.
        """
        self.augmentation.check()
        for name in ("epochs", "batch"):
            _check(name, getattr(self, name), getattr(self, name) >= 1, "at least 1")
        for name in (
            "seed", "patience", "warmup", "clip", "decoding_weight", "max_candidates", "threads",
            "save_every_s",
        ):  # fmt: skip
            _check(name, getattr(self, name), getattr(self, name) >= 0, "at least 0")
        for name in ("lr", "mixing_rate"):
            _check(name, getattr(self, name), getattr(self, name) > 0, "above 0")
        _check("averaging", self.averaging, 0 <= self.averaging < 1, "0 to below 1")
        _check("val_share", self.val_share, 0 < self.val_share < 1, "between 0 and 1")
        _check("new_share", self.new_share, 0 <= self.new_share < 1, "0 to below 1")
        _check("train_share", self.train_share, 0 < self.train_share <= 1, "above 0, at most 1")
        _check("device", self.device, self.device in ("cpu", "cuda"), "cpu or cuda")

    def network_config(self, feature_dim: int) -> NetworkConfig:
        """Say what network is trained.

        Args:
            feature_dim: Channels of the demonstrations' features.

        Returns:
            Its configuration.

        Raises:
            InvalidConfigError: If a setting does not exist or does not fit.
        """
        settings: dict[str, Any] = {}
        if self.variant == "a2" or self.variant == "vlg":
            config_type = network_type(self.variant).config_type
        else:
            config_type = network_type("sr").config_type
            settings |= ablation_switches(self.variant)
        settings |= dict(_parse_setting(text, config_type) for text in self.network)
        for name, value in (("width", self.width), ("max_points", self.points)):
            if value is not None:
                settings[name] = value
        return config_type(feature_dim=feature_dim, **settings)


def _parse_setting(text: str, config_type: type[NetworkConfig]) -> tuple[str, Any]:
    """Read one NAME=VALUE as the field of the configuration wants it."""
    types = typing.get_type_hints(config_type)
    name, equals, value = text.partition("=")
    names = [f.name for f in dataclasses.fields(config_type) if f.name != "feature_dim"]
    if not equals or name not in names:
        raise InvalidConfigError(
            f"network: got {text!r}, expected NAME=VALUE with one of {', '.join(names)}."
        )
    kind = types[name]
    try:
        if kind is bool:
            return name, {"true": True, "false": False}[value.lower()]
        return name, value if get_args(kind) else kind(value)
    except (KeyError, ValueError):
        expected = "true or false" if kind is bool else f"a value of type {kind.__name__}"
        raise InvalidConfigError(f"network: got {text!r}, expected {expected}.") from None


def _check(name: str, value: Any, is_valid: bool, expected: str) -> None:
    if not is_valid:
        raise InvalidConfigError(f"{name}: got {value}, expected {expected}.")


NO_AUGMENTATION = AugmentationConfig(
    rotation_deg=0.0,
    jitter_m=0.0,
    point_dropout=0.0,
    feature_dropout=0.0,
    channel_shuffle=0.0,
    prior_noise=0.0,
    paraphrases=0.0,
)
