"""Tells people, and programs, what happened in an episode."""

from typing import Any

import numpy as np

from sr_mj.attempt import Attempt
from sr_mj.episode import has_succeeded, is_handed_over
from sr_mj.instruction import describe_reading
from sr_mj.outcome import Reason
from sr_mj.scene import Scene

_PHRASES = {
    "pick": {
        Reason.NOTHING_IN_SIGHT: "no object in sight",
        Reason.NO_CANDIDATES: "no grasp found",
        Reason.UNREACHABLE: "no grasp can be reached",
        Reason.APPROACH_COLLISION: "bumped into something on the approach",
        Reason.EMPTY_CLOSE: "closed on nothing",
        Reason.SLIPPED_LIFT: "lost it while lifting",
        Reason.SLIPPED_CARRY: "lost it while carrying",
    },
    "place": {
        Reason.NOTHING_IN_SIGHT: "nothing to place it by in sight",
        Reason.NO_CANDIDATES: "no place found",
        Reason.UNREACHABLE: "no place can be reached",
        Reason.APPROACH_COLLISION: "bumped into something before it was down",
        Reason.SLIPPED_CARRY: "lost it on the way",
    },
}


def describe_scene(scene: Scene) -> str:
    """Introduce a scene in three lines: what it is, what is asked for, and how that is read."""
    num = len(scene.objects)
    return (
        f"Scene  {scene.config.title}, "
        f"{num} object{'' if num == 1 else 's'}\n"
        f"Goal   {scene.goal.text!r}\n"
        f"Read   {describe_reading(scene.goal.text)}"
    )


def describe_outcome(attempt: Attempt) -> str:
    """Say in a few words how an attempt ended."""
    outcome = attempt.outcome
    said = _describe_reason(attempt)
    if outcome.knocked_off and outcome.reason is not Reason.KNOCKED_OFF:
        said += f", {', '.join(outcome.knocked_off)} left the table"
    return said


def _describe_reason(attempt: Attempt) -> str:
    outcome, reason = attempt.outcome, attempt.outcome.reason
    missed = "" if outcome.missed_m is None else f", {outcome.missed_m * 100:.1f} cm off"
    own = {
        Reason.GRASPED_TARGET: f"grasped {outcome.grasped}",
        Reason.GRASPED_OTHER: f"grasped {outcome.grasped}, not asked for",
        Reason.PLACED: f"placed {outcome.grasped}",
        Reason.WRONG_REGION: f"{outcome.grasped} does not lie where it should{missed}",
        Reason.TOPPLED: f"{outcome.grasped} toppled or rolled away{missed}",
        Reason.TIMED_OUT: f"{outcome.grasped} does not come to rest",
        Reason.KNOCKED_OFF: f"{', '.join(outcome.knocked_off) or outcome.grasped} left the table",
    }
    return own[reason] if reason in own else _PHRASES[attempt.kind][reason]


def chosen_region(attempt: Attempt) -> dict[str, Any] | None:
    """Describe where the chosen action lies, without ground truth.

    Args:
        attempt: The attempt.

    Returns:
        Position of the tool in metres, similarity of the cloud within 2 cm to what the phase looks
        for (None if there is no point), width in metres; None if nothing was chosen.
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
    # A hand-over and the place attempt have no number: they are no attempts to grasp.
    mark = "ho" if attempt.is_hand_over else "pl" if attempt.kind == "place" else None
    parts = [
        mark or f"{attempt.index + 1:2d}",
        f"{num:3d} {'places' if attempt.kind == 'place' else 'grasps'}",
    ]
    region = chosen_region(attempt)
    if region is not None:
        x, y, z = region["position_m"]
        similarity = region["similarity"]
        seen = "" if similarity is None else f", similarity {similarity:.2f}"
        parts.append(f"chose ({x:.3f}, {y:+.3f}, {z:.3f}){seen}")
    parts.append(("handed over: " if attempt.is_hand_over else "") + describe_outcome(attempt))
    parts.append(f"[{_seconds(attempt, verbose)}]")
    return "  ".join(parts)


def _seconds(attempt: Attempt, verbose: bool) -> str:
    if not verbose:
        return f"{sum(attempt.seconds.values()):.1f} s"
    return ", ".join(f"{stage} {seconds:.2f} s" for stage, seconds in attempt.seconds.items())


def num_grasps(attempts: list[Attempt]) -> int:
    """Count the policy's attempts to grasp."""
    return sum(attempt.kind == "pick" and not attempt.is_hand_over for attempt in attempts)


def describe_result(scene: Scene, attempts: list[Attempt], max_attempts: int) -> str:
    """Tell in one line how the episode ended."""
    after = f"after {num_grasps(attempts)} of {max_attempts} attempts"
    place = scene.goal.place
    if has_succeeded(scene, attempts):
        name = attempts[-1].outcome.grasped
        if place is None:
            return f"Result success: {name} held at attempt {len(attempts)} of {max_attempts}"
        return f"Result success: {name} placed {place.relation} {' or '.join(place.references)}"
    if attempts and attempts[-1].kind == "place":
        unknown = place is not None and not place.references
        why = "no object of this scene is what to place it by; " if unknown else ""
        return f"Result failure: {why}{describe_outcome(attempts[-1])}"
    if not scene.goal.targets:
        why = "no object of this scene satisfies the goal"
    elif attempts and attempts[-1].outcome.reason is Reason.NOTHING_IN_SIGHT:
        why = "no object in sight"
    elif is_handed_over(scene):
        return f"Result failure: {' or '.join(scene.goal.targets)} could not be handed over"
    else:
        why = f"none of {', '.join(scene.goal.targets)} held"
    return f"Result failure: {why} {after}"


def attempt_record(attempt: Attempt) -> dict[str, Any]:
    """Return what is worth keeping of an attempt as plain JSON values; times are wall times."""
    percept, outcome = attempt.percept, attempt.outcome
    return {
        "attempt": attempt.index + 1,
        "kind": attempt.kind,
        "is_hand_over": attempt.is_hand_over,
        "num_points": 0 if percept is None else len(percept.geometry.points),
        "num_feature_points": 0 if percept is None else len(percept.features.points),
        "num_candidates": 0 if attempt.candidates is None else len(attempt.candidates),
        "num_unreachable": attempt.num_unreachable,
        "chosen": chosen_region(attempt),
        "T_world_tool": None if attempt.plan is None else attempt.plan.T_world_tool.tolist(),
        "success": outcome.success,
        "reason": outcome.reason.value,
        "grasped": outcome.grasped,
        "knocked_off": list(outcome.knocked_off),
        "reward": round(outcome.reward, 4),
        "missed_m": outcome.missed_m,
        "simulated_s": outcome.simulated_s,
        "seconds": {stage: round(seconds, 3) for stage, seconds in attempt.seconds.items()},
    }


def episode_record(scene: Scene, attempts: list[Attempt], max_attempts: int) -> dict[str, Any]:
    """Return the whole episode as plain JSON values."""
    place = scene.goal.place
    return {
        "scene": scene.config.scene,
        "arrangement": None if scene.config.arranged is None else scene.config.arranged.name,
        "split": scene.config.split,
        "seed": scene.config.seed,
        "goal": scene.goal.text,
        "objects": [item.name for item in scene.objects],
        "targets": list(scene.goal.targets),
        "relation": None if place is None else place.relation,
        "references": [] if place is None else list(place.references),
        "success": has_succeeded(scene, attempts),
        "num_attempts": num_grasps(attempts),
        "num_actions": num_actions(attempts),
        "max_attempts": max_attempts,
        "attempts": [attempt_record(attempt) for attempt in attempts],
    }


def num_actions(attempts: list[Attempt]) -> int:
    """Count what the policy had the arm do; a hand-over is not its doing."""
    return sum(attempt.plan is not None and not attempt.is_hand_over for attempt in attempts)
