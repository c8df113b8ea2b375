"""The main command: make a scene, look, decide, act, until the goal is met.

    python -m sr_mj.run --scene cluttered15 --goal "give me the banana"
    python -m sr_mj.run --scene place8 --goal "give me the apple, put it near the bowl"
    python -m sr_mj.run --scene grasp-seen-03
    python -m sr_mj.run --cases testing_cases/

Prints an account of every attempt and one line of result. The seed decides everything: the same
seed on the same machine gives the same account, times aside.
"""

import contextlib
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from sr_mj.cli import run_command
from sr_mj.errors import ConfigError

if TYPE_CHECKING:
    from perception.lifter import MultiViewLifter
    from policy.base import Policy
    from sr_mj.explain import Explainer
    from sr_mj.perturbation import PosePerturbation
    from sr_mj.scene import Scene, SceneConfig

MAX_ATTEMPTS = 100


@dataclass(frozen=True, kw_only=True)
class RunConfig:
    """Options of `python -m sr_mj.run`."""

    scene: str = "cluttered15"
    """Kind of scene (cluttered15, place8, pickplace8, heavy30, single, empty), or a fixed
    arrangement such as grasp-seen-03."""
    split: str = "seen"
    """Objects to use: seen or unseen."""
    seed: int = 0
    """Draws objects, how they fall, goal, sensor noise and candidates."""
    cases: Annotated[Path | None, tyro.conf.arg(metavar="PATH")] = None
    """Test cases of Vision-Language-Grasping or A2 to run one after another: a text file, a folder
    of them, or a JSON list. Takes the place of --scene."""
    objects: Annotated[Path | None, tyro.conf.arg(metavar="DIR")] = None
    """Folder of objects made by `python -m models.import_objects`, to use instead of ours."""
    goal: str | None = None
    """Instruction in free words, such as "give me the banana, put it near the bowl"; drawn from
    templates by default."""
    policy: str = "sr"
    """How a grasp or place is chosen: sr, the trained network; its ablations sr-a and base;
    grounding, which needs no weights and takes any encoder; the baselines random, clip-grounding,
    lerf-togo, think-grasp, vlp, raw-image, raw-image-grid, and the trained a2 and vlg; or oracle,
    which reads ground truth and marks the ceiling."""
    generator: str = "antipodal"
    """Where grasps come from: antipodal (our sampler), or a learnt generator's file:PATH or
    http://HOST:PORT/PATH (docs/generators.md)."""
    encoder: str = "embedded"
    """Image and text encoder: embedded (ships with the project), or ViT-L-14, ViT-B-16, ... from
    open_clip, optionally with a tag or file after a colon."""
    checkpoint: Path | None = None
    """Weights for a learnt policy."""
    attempts: int = 8
    """Grasps that may be tried; placing is tried once."""
    perturb_cm: float = 0.0
    """Standard deviation of an error added to the executed position, along each axis."""
    perturb_deg: float = 0.0
    """Standard deviation of an error added to the executed orientation, about each axis."""
    keep_unreachable: bool = False
    """Leave what the arm cannot reach to the policy, as the paper does: a bad choice then costs an
    attempt."""
    cameras: str = "sr"
    """Camera preset: sr or a2."""
    out: Path | None = None
    """New folder for configuration, versions, attempts as JSON, and pictures."""
    explain: Path | None = None
    """Folder for pictures of what a policy with attention (sr) attended to at every attempt: the
    semantic mask, the weights of the two branches in each layer, and the candidates' scores. May
    be the folder of --out."""
    record: Path | None = None
    """Video of the arm, .mp4 or .gif, at twice the real speed."""
    allow_download: bool = False
    """Let the encoder fetch missing weights from the hub."""
    json: Annotated[bool, tyro.conf.arg(name="json")] = False
    """Print one JSON object instead of the account."""
    verbose: bool = False
    """Print the seconds of every stage."""


def _check(config: RunConfig) -> None:
    """Refuse what can be refused before anything heavy is loaded."""
    if not 1 <= config.attempts <= MAX_ATTEMPTS:
        raise ConfigError(f"Attempts is {config.attempts}; expected 1 to {MAX_ATTEMPTS}.")
    for folder in filter(None, (config.out, config.explain)):
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise ConfigError(
                f"Output folder {str(folder)!r} exists and is not empty; choose a new one."
            )


def _scene_configs(config: RunConfig) -> "tuple[SceneConfig, ...]":
    """Say which scenes to run, in turn."""
    from models.arrangements.cases import read_cases
    from models.objects.catalogue import open_catalogue
    from sr_mj.scene import SceneConfig, scene_config

    options: dict[str, Any] = {
        "seed": config.seed,
        "cameras": config.cameras,
        "catalogue": config.objects,
    }
    if config.cases is None:
        _check_goal(config)
        return (scene_config(config.scene, split=config.split, goal=config.goal, **options),)
    if config.goal is not None:
        raise ConfigError("Test cases bring their own goals; leave --goal or --cases out.")
    cases = read_cases(config.cases, open_catalogue(config.objects), split=config.split)
    return tuple(SceneConfig(arrangement=case, **options) for case in cases)


def _check_goal(config: RunConfig) -> None:
    """Refuse a scene of which no goal can be drawn, and a goal that does not say what to pick.

    Arrangements have goals of their own, and say what "it" is in one that only says where to place.
    """
    from sr_mj.instruction import names_target
    from sr_mj.scene import SCENE_KINDS

    kind = SCENE_KINDS.get(config.scene)
    if kind is None:
        return
    if config.goal is None and not kind.num_objects:
        raise ConfigError(
            f"The scene {config.scene!r} has no objects from which to draw a goal; state one with "
            "--goal, or choose another scene, such as 'single'."
        )
    goal = (config.goal or "").strip()
    if goal and not names_target(goal):
        raise ConfigError(
            f"The goal {goal!r} does not say what to pick; say it first, as in "
            f"'give me the apple, {goal}', or choose a place arrangement."
        )


def _perturbation(config: RunConfig) -> "PosePerturbation | None":
    from sr_mj.perturbation import PosePerturbation

    perturbation = PosePerturbation(sigma_m=config.perturb_cm / 100, sigma_deg=config.perturb_deg)
    return perturbation if config.perturb_cm or config.perturb_deg else None


def run(config: RunConfig) -> int:
    """Run one episode, or one for each test case.

    Args:
        config: Options.

    Returns:
        Exit status 0: a failure in the world is a result, not an error.
    """
    _check(config)
    start = time.perf_counter()
    from sr_mj.gl import select_backend

    # Before anything imports dm_control, which binds OpenGL to one library for good.
    select_backend()
    from sr_mj.assemble import check_policy_name, lifter_for
    from sr_mj.candidates.external import check_generator_name
    from sr_mj.explain import check_explains
    from sr_mj.video import check_video_path

    # Mistakes first: nothing is made before every name is known to exist.
    scenes = _scene_configs(config)
    _perturbation(config)
    check_policy_name(config.policy)
    check_generator_name(config.generator)
    if config.explain is not None:
        check_explains(config.policy)
    if config.record is not None:
        check_video_path(config.record)
    lifter = lifter_for(
        scenes[0].kind.workspace, config.encoder, allow_download=config.allow_download
    )
    successes = 0
    for scene_config in scenes:
        successes += _run_episode(config, scene_config, lifter, is_one_of_many=len(scenes) > 1)
    if len(scenes) > 1 and not config.json:
        seconds = time.perf_counter() - start
        print(f"Cases  {successes} of {len(scenes)} succeeded [{seconds:.1f} s]")
    return 0


def _run_episode(
    config: RunConfig, scene_config: "SceneConfig", lifter: "MultiViewLifter", is_one_of_many: bool
) -> bool:
    """Run one episode, report it, and say whether it succeeded."""
    from sr_mj.assemble import assembled, make_policy
    from sr_mj.candidates.external import load_generator
    from sr_mj.episode import has_succeeded, run_episode
    from sr_mj.reporting import Reporter
    from sr_mj.scene import make_scene
    from sr_mj.video import VideoRecorder

    start = time.perf_counter()
    generator = load_generator(config.generator)
    scene = make_scene(scene_config)
    policy = make_policy(
        config.policy, scene, config.checkpoint, encoder=lifter.encoder.fingerprints
    )
    out, record, explain = config.out, config.record, config.explain
    if is_one_of_many:
        out = out and out / scene_config.title
        explain = explain and explain / scene_config.title
        record = record and record.with_stem(f"{record.stem}-{scene_config.title}")
    reporter = Reporter(config, scene, out)
    explainer = _explainer(policy, scene, explain)
    reporter.begin()
    with contextlib.ExitStack() as stack:
        film = record and stack.enter_context(VideoRecorder(scene, record))
        pipeline = stack.enter_context(
            assembled(
                scene,
                lifter=lifter,
                policy=policy,
                generator=generator,
                on_step=film or None,
                perturbation=_perturbation(config),
                keep_unreachable=config.keep_unreachable,
            )
        )
        for attempt in run_episode(scene, pipeline, seed=config.seed, max_attempts=config.attempts):
            reporter.add(attempt)
            if explainer is not None:
                explainer.add(attempt)
    reporter.finish(time.perf_counter() - start)
    return has_succeeded(scene, reporter.attempts)


def _explainer(policy: "Policy", scene: "Scene", folder: Path | None) -> "Explainer | None":
    from policy.explanation import ExplainingPolicy
    from sr_mj.explain import Explainer

    if folder is None:
        return None
    assert isinstance(policy, ExplainingPolicy), "check_explains lets no other policy through"
    return Explainer(policy, scene, folder)


def main() -> None:
    """Entry point of the command line."""
    run_command(RunConfig, run, description=__doc__ or "")


if __name__ == "__main__":
    sys.exit(main())
