"""The line of results of one episode."""

from dataclasses import dataclass
from typing import Any

from sr_mj.evaluation.identity import Identity
from sr_mj.evaluation.plan import Episode
from sr_mj.evaluation.setting import Setting

# What the account of an episode calls these is told by the episode itself, or by its identity.
_TOLD_ELSEWHERE = ("scene", "arrangement", "split", "seed", "max_attempts", "success")


@dataclass(frozen=True, kw_only=True)
class Done:
    """What came of an episode.

    Attributes:
        episode: The episode.
        record: Its line of results: no times, so that the same episode gives the same line.
        seconds: Wall time of the whole episode ("total") and of every stage.
        traceback: Of the exception that ended it, if one did.
        lost_pictures: Why its pictures could not be kept, if they should have been.
    """

    episode: Episode
    record: dict[str, Any]
    seconds: dict[str, float]
    traceback: str | None = None
    lost_pictures: str | None = None


def result_line(
    episode: Episode,
    setting: Setting,
    identity: Identity,
    told: dict[str, Any],
    error: str | None,
) -> dict[str, Any]:
    """Put together the line of an episode; one that ended in an exception is a failure.

    Args:
        episode: The episode.
        setting: What all episodes share.
        identity: Says what the result depends on.
        told: Account of it (`sr_mj.account.episode_record`); empty if it never began.
        error: The exception that ended it, in one line, or None.

    Returns:
        Plain JSON values without times.
    """
    attempts = [
        {name: value for name, value in attempt.items() if name != "seconds"}
        for attempt in told.get("attempts", [])
    ]
    success = bool(told.get("success")) and error is None
    return {
        **episode.record(),
        "success": success,
        "cause": None if success else failure_cause(attempts, error),
        "error": error,
        "num_actions": 0,
        **{name: value for name, value in told.items() if name not in _TOLD_ELSEWHERE},
        "attempts": attempts,
        **identity.of(episode),
        "versions": setting.versions,
        "revision": setting.revision,
    }


def failure_cause(attempts: list[dict[str, Any]], error: str | None) -> str:
    """Say why an episode failed: how its last attempt ended, and in which phase.

    Args:
        attempts: Records of its attempts.
        error: The exception that ended it, if one did.

    Returns:
        For example "pick: wrong_object", "hand-over: unreachable", "error".
    """
    if error is not None:
        return "error"
    if not attempts:
        return "nothing tried"
    last = attempts[-1]
    return f"{'hand-over' if last['is_hand_over'] else last['kind']}: {last['reason']}"
