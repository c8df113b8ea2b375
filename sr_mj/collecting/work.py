"""What goes to a worker, and what comes back: the types between processes and machines."""

from collections.abc import Callable
from dataclasses import dataclass, field

from sr_mj.collecting.tasks import SceneTask


@dataclass(frozen=True, kw_only=True)
class Limits:
    """How much is taken from one scene; few decisions of many scenes teach more than many of few.

    Attributes:
        num_looks: States of a heap, one object fewer each time.
        num_picks: Decisions in each.
        num_rounds: Objects that are placed in one scene.
        num_places: Decisions to place each.
    """

    num_looks: int = 4
    num_picks: int = 4
    num_rounds: int = 2
    num_places: int = 5


@dataclass(frozen=True, kw_only=True)
class WorkSetting:
    """What all scenes share.

    Attributes:
        encoder: Name of the encoder.
        allow_download: Whether its weights may be fetched.
        limits: How much is taken from one scene.
    """

    encoder: str = "embedded"
    allow_download: bool = False
    limits: Limits = field(default_factory=Limits)


@dataclass(frozen=True, kw_only=True)
class SceneResult:
    """What came of a scene.

    Attributes:
        task: The scene.
        file_name: Name of the file to keep; None if nothing is known of the scene.
        content: The file.
        stored: Decisions in it, by phase.
        reasons: How often what was tried ended how, successes aside.
        seconds: Wall time.
        cpu_seconds: Processor time.
        error: What went wrong in the program, if anything did.
    """

    task: SceneTask
    file_name: str | None = None
    content: bytes = b""
    stored: dict[str, int] = field(default_factory=dict)
    reasons: dict[str, int] = field(default_factory=dict)
    seconds: float = 0.0
    cpu_seconds: float = 0.0
    error: str | None = None


Work = Callable[[SceneTask], SceneResult]
"""Does a scene; made once in every process."""


def attempt(work: Work, task: SceneTask) -> SceneResult:
    """Do a scene; an exception is part of the result.

    Args:
        work: Does it.
        task: The scene.

    Returns:
        What came of it.
    """
    import traceback

    try:
        return work(task)
    except Exception:
        return SceneResult(task=task, reasons={"error": 1}, error=traceback.format_exc())
