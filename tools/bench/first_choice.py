"""What would policies grasp first? Nothing is executed.

    python -m tools.bench.first_choice --scene cluttered15 --seeds 100 108

Every scene is photographed once and asked for whatever the protocol's words allow. Only questions
count for which some grasp that the arm can reach closes on what is asked for. Prints a table: the
share of first choices that close on a target, with 95 % Wilson intervals, and seconds of processor
time a decision.
"""

import time
from dataclasses import dataclass

import numpy as np
from tqdm import tqdm

from perception.errors import EmptyCloudError
from perception.lifter import MultiViewLifter
from policy.actions import ActionCandidates
from policy.base import Policy
from policy.errors import InvalidConfigError
from policy.observation import Observation
from sr_mj.assemble import check_policy_name, lifter_for, make_policy
from sr_mj.candidates.antipodal import AntipodalSampler
from sr_mj.cli import run_command
from sr_mj.evaluation.statistics import wilson
from sr_mj.instruction import pick_text
from sr_mj.oracle import OraclePolicy
from sr_mj.pipeline import observe
from sr_mj.planning import Planner
from sr_mj.scene import SceneConfig
from sr_mj.view_images import ViewImages
from tools.bench.grounding_scenes import BenchScene, list_questions, photograph
from tools.table_text import markdown, percent, title


@dataclass(frozen=True, kw_only=True)
class FirstChoiceConfig:
    """Options of `python -m tools.bench.first_choice`."""

    policies: tuple[str, ...] = (
        "grounding",
        "clip-grounding",
        "lerf-togo",
        "think-grasp",
        "raw-image-grid",
        "raw-image",
        "random",
    )
    """Names of policies."""
    scene: str = "cluttered15"
    """Kind of random scene."""
    split: str = "seen"
    """Objects."""
    seeds: tuple[int, int] = (100, 108)
    """First seed and one past the last."""
    encoder: str = "embedded"
    """Image and text encoder."""

    def __post_init__(self) -> None:
        """Check what would otherwise end in an empty table."""
        if not self.policies:
            raise InvalidConfigError("policies: got none, expected at least one name.")


@dataclass(frozen=True, kw_only=True, eq=False)
class Decision:
    """A decision that can be made rightly.

    Attributes:
        observation: What a policy sees.
        candidates: What it chooses among.
        is_right: (K,) whether a candidate closes on a target. Ground truth.
    """

    observation: Observation
    candidates: ActionCandidates
    is_right: np.ndarray


def decisions(bench: BenchScene, lifter: MultiViewLifter) -> list[Decision]:
    """Ask for everything in a scene that can be grasped.

    Args:
        bench: The scene.
        lifter: Perception stage, for the scene's workspace.

    Returns:
        A decision for each of the protocol's questions for which some candidate is right.
    """
    scene = bench.scene
    try:
        geometry = lifter.lift(bench.views).geometry
    except EmptyCloudError:
        return []
    assert geometry is not None
    candidates = AntipodalSampler().pick(geometry, np.random.default_rng(bench.seed))
    candidates = candidates.take(np.flatnonzero(Planner().reachable(candidates)))
    gripped, names = OraclePolicy(scene).gripped(candidates), np.array(list(bench.words))
    found = []
    for question in list_questions(bench, np.arange(len(names))):
        is_right = np.isin(gripped, names[list(question.targets)])
        if question.is_paraphrase or not is_right.any():
            continue
        text = pick_text(question.text)
        percept = lifter.perceive(bench.views, text.text, unwanted=text.unwanted)
        images = ViewImages(views=bench.views, encoder=lifter.encoder)
        observation = observe(percept, scene, text, images)
        found.append(Decision(observation=observation, candidates=candidates, is_right=is_right))
    return found


def main(config: FirstChoiceConfig) -> int:
    """Measure and print a table in markdown."""
    for name in config.policies:
        check_policy_name(name)
    right: dict[str, list[bool]] = {name: [] for name in config.policies}
    seconds = dict.fromkeys(config.policies, 0.0)
    lifter = lifter_for(SceneConfig(scene=config.scene).kind.workspace, config.encoder)
    for seed in tqdm(range(*config.seeds), unit="scenes"):
        bench = photograph(config.scene, config.split, seed)
        asked = decisions(bench, lifter)
        for name in config.policies:
            policy, rng = make_policy(name, bench.scene), np.random.default_rng(seed)
            start = time.process_time()
            right[name] += [_is_right(policy, decision, rng) for decision in asked]
            seconds[name] += time.process_time() - start
    total = len(right[config.policies[0]])
    if not total:
        raise InvalidConfigError(
            f"seeds: got {config.seeds}, among which nothing can be asked for and grasped; "
            "expected more scenes."
        )
    rows = [
        [title(name), percent(wilson(sum(own), total)), f"{seconds[name] / total:.2f}"]
        for name, own in right.items()
    ]
    print(markdown(["policy", f"`{config.scene}`, {total} questions", "seconds"], rows))
    return 0


def _is_right(policy: Policy, decision: Decision, rng: np.random.Generator) -> bool:
    scores = policy.score(decision.observation, decision.candidates, rng)
    return bool(decision.is_right[scores.best])


if __name__ == "__main__":
    run_command(FirstChoiceConfig, main, __doc__ or "")
