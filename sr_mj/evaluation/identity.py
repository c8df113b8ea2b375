"""What the result of an episode depends on, and how a line of results proves it."""

import hashlib
import json
from pathlib import Path
from typing import Any

import policy
from models.arrangements.arrangement import to_record
from models.arrangements.library import arrangement_names, load_arrangement
from sr_mj.errors import ConfigError
from sr_mj.evaluation.plan import Episode, PolicyChoice
from sr_mj.evaluation.setting import BLANK, PRIVILEGED_POLICIES, Setting

PLAIN_MAKER = "sr_mj.scene.make_scene"
"""What lines of results call the usual maker of random scenes."""

NOT_KNOWN_BEFORE = ("card_sha256", "scene_maker")
"""Entries that earlier versions did not write: where a line lacks one, it is not known."""

# What a card is loaded for; how the training went changes no result.
_LOADED = ("format", "kind", "config", "encoder")


def weights_hash(choice: PolicyChoice) -> str | None:
    """Hash the weights of a policy.

    Args:
        choice: The policy.

    Returns:
        SHA-256 of its checkpoint, or of the one shipped under its name; None if it has none.
    """
    path = _weights_path(choice)
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else None


def card_hash(choice: PolicyChoice) -> str | None:
    """Hash what a policy loads from the card beside its weights, such as the points it looks at.

    Args:
        choice: The policy.

    Returns:
        SHA-256; None if there is no card that could be read, with which no policy loads.
    """
    path = _weights_path(choice).with_suffix(".json")
    if not path.is_file():
        return None
    try:
        card = json.loads(path.read_text())
        loaded = {name: card.get(name) for name in _LOADED}
    except (ValueError, AttributeError):
        return None
    return hashlib.sha256(json.dumps(loaded, sort_keys=True).encode()).hexdigest()


def _weights_path(choice: PolicyChoice) -> Path:
    shipped = Path(policy.__file__).parent / "weights" / f"{choice.name.replace('-', '_')}"
    return choice.checkpoint or shipped.with_suffix(".safetensors")


class Identity:
    """Says what an episode's result depends on; the same for equal inputs.

    Args:
        setting: What all episodes share.
    """

    def __init__(self, setting: Setting) -> None:
        """Hash the policies' files once."""
        self._setting = setting
        self._policies = {choice.label: _of_policy(choice, setting) for choice in setting.policies}
        self._arrangements: dict[str, str | None] = {}

    def of(self, episode: Episode) -> dict[str, Any]:
        """Return names, hashes and settings as plain JSON values."""
        return {**self._policies[episode.policy], **self._of_run(episode)}

    def check(self, episode: Episode, record: dict[str, Any]) -> None:
        """Refuse an earlier result that was made with something else.

        A result of a policy that does not run now is held against what all policies share. A line
        without a hash of the card is taken: earlier versions wrote none.

        Args:
            episode: Any episode of which there is a result.
            record: Its line.

        Raises:
            ConfigError: If an entry differs.
        """
        for name, expected in self._expected(episode, record).items():
            is_known = name in record
            if not is_known and (name == "card_sha256" or expected is None):
                continue
            if not is_known or record[name] != expected:
                found = f"{name} {record[name]!r}" if is_known else f"no {name}"
                raise ConfigError(
                    f"The results to resume have {found} in episode {episode.key}, this run has "
                    f"{expected!r}; use the same options and files, or a new --out."
                )

    def _expected(self, episode: Episode, record: dict[str, Any]) -> dict[str, Any]:
        expected = self._of_run(episode)
        if episode.policy in self._policies:
            expected |= self._policies[episode.policy]
        elif record.get("encoder") != BLANK:
            expected |= _encoder(self._setting, self._setting.encoder)
        return expected

    def _of_run(self, episode: Episode) -> dict[str, Any]:
        """Return what does not depend on the policy."""
        setting = self._setting
        return {
            "arrangement_sha256": self._arrangement(episode),
            "scene_maker": None if episode.is_arranged else _maker(setting, episode.scene),
            "generator": setting.generator,
            "cameras": setting.cameras,
            "max_attempts": setting.attempts,
            "keep_unreachable": setting.keep_unreachable,
        }

    def _arrangement(self, episode: Episode) -> str | None:
        name = episode.scene
        if not episode.is_arranged or name not in arrangement_names():
            return None
        if name not in self._arrangements:
            self._arrangements[name] = to_record(load_arrangement(name))["sha256"]
        return self._arrangements[name]


def _of_policy(choice: PolicyChoice, setting: Setting) -> dict[str, Any]:
    return {
        "privileged": choice.name in PRIVILEGED_POLICIES,
        "weights_sha256": weights_hash(choice),
        "card_sha256": card_hash(choice),
        **_encoder(setting, setting.encoder_for(choice.label)),
    }


def _encoder(setting: Setting, name: str) -> dict[str, Any]:
    fingerprint = name if name == BLANK else setting.encoder_fingerprint
    return {"encoder": name, "encoder_fingerprint": fingerprint}


def _maker(setting: Setting, kind: str) -> str:
    maker = setting.scene_makers.get(kind)
    return PLAIN_MAKER if maker is None else f"{maker.__module__}.{maker.__qualname__}"
