"""From what a policy wants most to what the robot will do."""

from dataclasses import replace
from functools import partial

import numpy as np

from sr_mj.perturbation import PoseError, raised
from sr_mj.pipeline import Pipeline
from sr_mj.planning import Plan
from sr_mj.scene import Scene
from sr_mj.situation import Situation


def plan_choice(
    scene: Scene,
    pipeline: Pipeline,
    situation: Situation,
    order: np.ndarray,
    error: PoseError | None = None,
) -> Plan | None:
    """Plan the candidate most wanted that can be executed, and execute it with an error.

    An error is nothing that a planner knows: it does not change the choice, and where the erring
    pose touches something, that is what the robot runs into.

    Args:
        scene: For its goal: what is to be placed is shaken over the bin.
        pipeline: The stages.
        situation: What is seen, and the candidates.
        order: (K,) indices of the candidates, most wanted first.
        error: Of the executed pose; None for none.

    Returns:
        The plan, whose `chosen` is a candidate even if its pose is not; None if no candidate can be
        executed, or not the chosen one with its error.
    """
    percept, candidates, held = situation.percept, situation.candidates, situation.held
    assert percept is not None and candidates is not None
    # With unreachable candidates among them, the policy's choice is final.
    order = order[:1] if pipeline.keep_unreachable else order
    start = None if held is None else pipeline.executor.drive.arm_qpos
    shake_off = scene.goal.place is not None and pipeline.shakes_off
    make = partial(pipeline.planner.plan, held=held, start=start, shake_off=shake_off)
    plan = make(candidates, order, obstacles=percept.geometry.points)
    if plan is None or error is None:
        return plan
    erring = error.apply(candidates.take(np.array([plan.chosen])))
    for poses, obstacles in ((erring, percept.geometry.points), (raised(erring), None)):
        erred = make(poses, np.arange(len(poses)), obstacles=obstacles)
        if erred is not None:
            return replace(erred, chosen=plan.chosen)
    return None
