"""What lines of results and of times have to hold for a report to be made from them."""

from typing import Any

from sr_mj.evaluation.plan import Episode

Form = dict[str, type | tuple[type, ...]]

_TEXT_OR_NONE = (str, type(None))
# Lines of earlier versions have all of this.
_LINE: Form = {
    **{name: str for name in ("task", "split", "scene", "condition", "policy")},
    **{"seed": int, "success": bool, "privileged": bool, "attempts": list, "num_actions": int},
    **{name: _TEXT_OR_NONE for name in ("cause", "error", "arrangement_sha256")},
}
# What a line tells of an episode that has begun: one that broke before has none of it.
_BEGUN: Form = {
    **{"goal": str, "objects": list, "targets": list, "references": list},
    "relation": _TEXT_OR_NONE,
}
_ATTEMPT: Form = {"kind": str, "is_hand_over": bool, "reason": str, "reward": (float, int)}
_TIMES: Form = {**{name: _LINE[name] for name in Episode.__dataclass_fields__}, "seconds": dict}
_ENTRY: Form = {"record": dict, "seconds": dict}


def check_line(value: Any) -> None:
    """Refuse what is no line of results.

    Args:
        value: What JSON was read as.

    Raises:
        ValueError: If it is something else; says what is missing or wrong.
    """
    _check(value, _LINE)
    if "goal" in value:
        _check(value, _BEGUN)
    for attempt in value["attempts"]:
        _check(attempt, _ATTEMPT)


def check_times(value: Any) -> None:
    """Refuse what is no line of times; as `check_line`."""
    _check(value, _TIMES)


def check_entry(value: Any) -> None:
    """Refuse what is no entry of a journal, a line with its times; as `check_line`."""
    _check(value, _ENTRY)
    check_line(value["record"])


def _check(value: Any, form: Form) -> None:
    if not isinstance(value, dict):
        raise ValueError("expected an object with names and values")
    for name, kind in form.items():
        if name not in value:
            raise ValueError(f"there is no {name!r}")
        if not isinstance(value[name], kind):
            raise ValueError(f"{name!r} is {value[name]!r}")
