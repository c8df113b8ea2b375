"""Other wordings of the arrangements' goals, none of which a template of the protocol makes."""

import functools
import json
from importlib import resources


@functools.cache
def _table() -> dict[str, tuple[str, ...]]:
    text = resources.files("models.arrangements").joinpath("paraphrases.json").read_text()
    return {goal: tuple(others) for goal, others in json.loads(text).items()}


def paraphrases(goal: str) -> tuple[str, ...]:
    """Return other wordings of a goal.

    Args:
        goal: Text of an arrangement's goal.

    Returns:
        At least five sentences for every goal of `models.arrangements.library`, none for others.
    """
    return _table().get(goal, ())


def wordings(goal: str) -> tuple[str, ...]:
    """Return a goal's own text and its other wordings."""
    return (goal, *paraphrases(goal))
