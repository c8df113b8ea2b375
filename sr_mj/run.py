"""The main command: make a scene, look, decide, act, until the goal is met.

    python -m sr_mj.run --scene cluttered15 --goal "give me the banana"
    python -m sr_mj.run --scene grasp-seen-03
    python -m sr_mj.run --cases testing_cases/

Prints an account of every attempt and one line of result. The seed decides everything: the same
seed on the same machine gives the same account, times aside.
"""

import contextlib
import json
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
    from sr_mj.episode import Attempt
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
    """Instruction in free words, such as "give me the banana"; drawn from templates by default."""
    policy: str = "grounding"
    """How a grasp is chosen: grounding, random, sr (needs trained weights), or oracle, which reads
    ground truth and marks the ceiling."""
    encoder: str = "embedded"
    """Image and text encoder: embedded (ships with the project), or ViT-L-14, ViT-B-16, ... from
    open_clip, optionally with a tag or file after a colon."""
    checkpoint: Path | None = None
    """Weights for a learnt policy."""
    attempts: int = 8
    """Grasps that may be tried."""
    cameras: str = "sr"
    """Camera preset: sr or a2."""
    out: Path | None = None
    """New folder for configuration, versions, attempts as JSON, and pictures."""
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
    if (
        config.out is not None
        and config.out.exists()
        and (not config.out.is_dir() or any(config.out.iterdir()))
    ):
        raise ConfigError(
            f"Output folder {str(config.out)!r} exists and is not empty; choose a new one."
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
        scene = scene_config(config.scene, split=config.split, goal=config.goal, **options)
        if scene.arranged is not None and scene.arranged.suite == "place":
            raise ConfigError(
                f"Arrangement {config.scene!r} asks for placing only, which is not carried out "
                "yet; choose a grasp or pick-place arrangement, or export this one."
            )
        return (scene,)
    if config.goal is not None:
        raise ConfigError("Test cases bring their own goals; leave --goal or --cases out.")
    cases = read_cases(config.cases, open_catalogue(config.objects), split=config.split)
    return tuple(SceneConfig(arrangement=case, **options) for case in cases)


class _Reporter:
    """Prints the account as it happens and keeps it in the output folder."""

    def __init__(self, config: RunConfig, scene: "Scene", out: Path | None) -> None:
        self._config, self._scene, self._out = config, scene, out
        self.attempts: list[Attempt] = []

    def begin(self) -> None:
        from sr_mj.account import describe_scene
        from sr_mj.provenance import git_revision, package_versions, to_json

        config = self._config
        if self._out is not None:
            self._out.mkdir(parents=True, exist_ok=True)
            about = {
                "config": config,
                "goal": self._scene.goal.text,
                "git_revision": git_revision(),
                "versions": package_versions(),
            }
            (self._out / "run.json").write_text(to_json(about))
        if not config.json:
            print(describe_scene(self._scene))
            note = " (reads ground truth)" if config.policy == "oracle" else ""
            print(f"Policy {config.policy}{note}, encoder {config.encoder}", flush=True)

    def add(self, attempt: "Attempt") -> None:
        from sr_mj.account import attempt_record, describe_attempt
        from sr_mj.pictures import save_pictures

        self.attempts.append(attempt)
        if not self._config.json:
            print(describe_attempt(attempt, verbose=self._config.verbose), flush=True)
        if self._out is not None:
            with (self._out / "attempts.jsonl").open("a") as file:
                file.write(json.dumps(attempt_record(attempt)) + "\n")
            save_pictures(attempt, self._out)

    def finish(self, seconds: float) -> None:
        from sr_mj.account import describe_result, episode_record

        record: dict[str, Any] = episode_record(self._scene, self.attempts, self._config.attempts)
        record["seconds"] = round(seconds, 2)
        if self._out is not None:
            (self._out / "result.json").write_text(json.dumps(record, indent=2) + "\n")
        if self._config.json:
            print(json.dumps(record))
        else:
            result = describe_result(self._scene, self.attempts, self._config.attempts)
            print(f"{result} [{seconds:.1f} s]")


def run(config: RunConfig) -> int:
    """Run one episode, or one for each test case.

    Args:
        config: Options.

    Returns:
        Exit status 0: a failed grasp is a result, not an error.
    """
    _check(config)
    start = time.perf_counter()
    from sr_mj.gl import select_backend

    # Before anything imports dm_control, which binds OpenGL to one library for good.
    select_backend()
    from sr_mj.assemble import check_policy_name, lifter_for
    from sr_mj.video import check_video_path

    # Mistakes first: nothing is made before every name is known to exist.
    scenes = _scene_configs(config)
    check_policy_name(config.policy)
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
    from sr_mj.episode import run_episode
    from sr_mj.scene import make_scene
    from sr_mj.video import VideoRecorder

    start = time.perf_counter()
    scene = make_scene(scene_config)
    policy = make_policy(config.policy, scene, config.checkpoint)
    out, record = config.out, config.record
    if is_one_of_many:
        out = out and out / scene_config.title
        record = record and record.with_stem(f"{record.stem}-{scene_config.title}")
    reporter = _Reporter(config, scene, out)
    reporter.begin()
    with contextlib.ExitStack() as stack:
        film = record and stack.enter_context(VideoRecorder(scene, record))
        pipeline = stack.enter_context(
            assembled(scene, lifter=lifter, policy=policy, on_step=film or None)
        )
        for attempt in run_episode(scene, pipeline, seed=config.seed, max_attempts=config.attempts):
            reporter.add(attempt)
    reporter.finish(time.perf_counter() - start)
    return bool(reporter.attempts and reporter.attempts[-1].outcome.success)


def main() -> None:
    """Entry point of the command line."""
    run_command(RunConfig, run, description=__doc__ or "")


if __name__ == "__main__":
    sys.exit(main())
