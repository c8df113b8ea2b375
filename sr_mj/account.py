"""Tells people, and programs, what happened in an episode."""

from typing import Any

import numpy as np

from sr_mj.episode import Attempt
from sr_mj.outcome import Reason
from sr_mj.scene import Scene

_PHRASES = {
    Reason.NOTHING_IN_SIGHT: "no object in sight",
    Reason.NO_CANDIDATES: "no grasp found",
    Reason.UNREACHABLE: "no grasp can be reached",
    Reason.APPROACH_COLLISION: "bumped into something on the approach",
    Reason.EMPTY_CLOSE: "closed on nothing",
    Reason.SLIPPED_LIFT: "lost it while lifting",
    Reason.SLIPPED_CARRY: "lost it while carrying",
}


def describe_scene(scene: Scene) -> str:
    """Introduce a scene in two lines."""
    num = len(scene.objects)
    return (
        f"Scene  {scene.config.title}, "
        f"{num} object{'' if num == 1 else 's'}\n"
        f"Goal   {scene.goal.text!r}"
    )


def describe_outcome(attempt: Attempt) -> str:
    """Say in a few words how an attempt ended."""
    outcome = attempt.outcome
    if outcome.reason is Reason.GRASPED_TARGET:
        return f"grasped {outcome.grasped}"
    if outcome.reason is Reason.GRASPED_OTHER:
        return f"grasped {outcome.grasped}, not asked for"
    return _PHRASES[outcome.reason]


def chosen_region(attempt: Attempt) -> dict[str, Any] | None:
    """Describe where the chosen grasp lies, without ground truth.

    Args:
        attempt: The attempt.

    Returns:
        Position of the tool in metres, similarity to the instruction of the cloud within 2 cm
        (None if there is no point), width in metres; None if nothing was chosen.
    """
    if attempt.plan is None or attempt.percept is None or attempt.candidates is None:
        return None
    position = attempt.plan.T_world_tool[:3, 3]
    cloud = attempt.percept.features
    near = np.linalg.norm(cloud.points - position, axis=1) < 0.02
    return {
        "position_m": [round(float(x), 4) for x in position],
        "similarity": round(float(cloud.similarity[near].mean()), 4) if near.any() else None,
        "width_m": round(float(attempt.candidates.width_m[attempt.plan.chosen]), 4),
    }


def describe_attempt(attempt: Attempt, *, verbose: bool = False) -> str:
    """Tell an attempt in one line; `verbose` adds the seconds of every stage."""
    num = 0 if attempt.candidates is None else len(attempt.candidates)
    parts = [f"{attempt.index + 1:2d}", f"{num:3d} grasps"]
    region = chosen_region(attempt)
    if region is not None:
        x, y, z = region["position_m"]
        similarity = region["similarity"]
        seen = "" if similarity is None else f", similarity {similarity:.2f}"
        parts.append(f"chose ({x:.3f}, {y:+.3f}, {z:.3f}){seen}")
    parts.append(describe_outcome(attempt))
    parts.append(f"[{_seconds(attempt, verbose)}]")
    return "  ".join(parts)


def _seconds(attempt: Attempt, verbose: bool) -> str:
    if not verbose:
        return f"{sum(attempt.seconds.values()):.1f} s"
    return ", ".join(f"{stage} {seconds:.2f} s" for stage, seconds in attempt.seconds.items())


def describe_result(scene: Scene, attempts: list[Attempt], max_attempts: int) -> str:
    """Tell in one line how the episode ended."""
    if attempts and attempts[-1].outcome.success:
        return (
            f"Result success: {attempts[-1].outcome.grasped} held at attempt {len(attempts)} "
            f"of {max_attempts}"
        )
    if not scene.goal.targets:
        why = "no object of this scene satisfies the goal"
    elif attempts and attempts[-1].outcome.reason is Reason.NOTHING_IN_SIGHT:
        why = "no object in sight"
    else:
        why = f"none of {', '.join(scene.goal.targets)} held"
    return f"Result failure: {why} after {len(attempts)} of {max_attempts} attempts"


def attempt_record(attempt: Attempt) -> dict[str, Any]:
    """Return what is worth keeping of an attempt as plain JSON values; times are wall times."""
    percept, outcome = attempt.percept, attempt.outcome
    return {
        "attempt": attempt.index + 1,
        "num_points": 0 if percept is None else len(percept.geometry.points),
        "num_feature_points": 0 if percept is None else len(percept.features.points),
        "num_candidates": 0 if attempt.candidates is None else len(attempt.candidates),
        "chosen": chosen_region(attempt),
        "T_world_tool": None if attempt.plan is None else attempt.plan.T_world_tool.tolist(),
        "success": outcome.success,
        "reason": outcome.reason.value,
        "grasped": outcome.grasped,
        "simulated_s": outcome.simulated_s,
        "seconds": {stage: round(seconds, 3) for stage, seconds in attempt.seconds.items()},
    }


def episode_record(scene: Scene, attempts: list[Attempt], max_attempts: int) -> dict[str, Any]:
    """Return the whole episode as plain JSON values."""
    return {
        "scene": scene.config.scene,
        "arrangement": None if scene.config.arranged is None else scene.config.arranged.name,
        "split": scene.config.split,
        "seed": scene.config.seed,
        "goal": scene.goal.text,
        "objects": [item.name for item in scene.objects],
        "targets": list(scene.goal.targets),
        "success": bool(attempts and attempts[-1].outcome.success),
        "num_attempts": len(attempts),
        "max_attempts": max_attempts,
        "attempts": [attempt_record(attempt) for attempt in attempts],
    }
