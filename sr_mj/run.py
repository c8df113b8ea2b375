"""The main command: make a scene, look, decide, act, until the goal is met.

    python -m sr_mj.run --scene cluttered15 --goal "give me the banana"

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
    from sr_mj.episode import Attempt
    from sr_mj.scene import Scene, SceneConfig

MAX_ATTEMPTS = 100


@dataclass(frozen=True, kw_only=True)
class RunConfig:
    """Options of `python -m sr_mj.run`."""

    scene: str = "cluttered15"
    """Kind of scene: cluttered15, place8, pickplace8, single or empty."""
    split: str = "seen"
    """Objects to use: seen or unseen."""
    seed: int = 0
    """Draws objects, arrangement, goal, sensor noise and candidates."""
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


def _scene_config(config: RunConfig) -> "SceneConfig":
    from sr_mj.scene import SceneConfig

    return SceneConfig(
        scene=config.scene,
        split=config.split,  # pyright: ignore[reportArgumentType]  # checked there
        seed=config.seed,
        goal=config.goal,
        cameras=config.cameras,
    )


class _Reporter:
    """Prints the account as it happens and keeps it in the output folder."""

    def __init__(self, config: RunConfig, scene: "Scene") -> None:
        self._config, self._scene = config, scene
        self.attempts: list[Attempt] = []

    def begin(self) -> None:
        from sr_mj.account import describe_scene
        from sr_mj.provenance import git_revision, package_versions, to_json

        config = self._config
        if config.out is not None:
            config.out.mkdir(parents=True, exist_ok=True)
            about = {
                "config": config,
                "goal": self._scene.goal.text,
                "git_revision": git_revision(),
                "versions": package_versions(),
            }
            (config.out / "run.json").write_text(to_json(about))
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
        if self._config.out is not None:
            with (self._config.out / "attempts.jsonl").open("a") as file:
                file.write(json.dumps(attempt_record(attempt)) + "\n")
            save_pictures(attempt, self._config.out)

    def finish(self, seconds: float) -> None:
        from sr_mj.account import describe_result, episode_record

        record: dict[str, Any] = episode_record(self._scene, self.attempts, self._config.attempts)
        record["seconds"] = round(seconds, 2)
        if self._config.out is not None:
            (self._config.out / "result.json").write_text(json.dumps(record, indent=2) + "\n")
        if self._config.json:
            print(json.dumps(record))
        else:
            result = describe_result(self._scene, self.attempts, self._config.attempts)
            print(f"{result} [{seconds:.1f} s]")


def run(config: RunConfig) -> int:
    """Run one episode.

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
    from sr_mj.assemble import assembled, check_policy_name, lifter_for, make_policy
    from sr_mj.episode import run_episode
    from sr_mj.scene import make_scene
    from sr_mj.video import VideoRecorder, check_video_path

    # Mistakes first: nothing is made before every name is known to exist.
    scene_config = _scene_config(config)
    check_policy_name(config.policy)
    if config.record is not None:
        check_video_path(config.record)
    lifter = lifter_for(
        scene_config.kind.workspace, config.encoder, allow_download=config.allow_download
    )
    scene = make_scene(scene_config)
    policy = make_policy(config.policy, scene, config.checkpoint)
    reporter = _Reporter(config, scene)
    reporter.begin()
    with contextlib.ExitStack() as stack:
        film = config.record and stack.enter_context(VideoRecorder(scene, config.record))
        pipeline = stack.enter_context(
            assembled(scene, lifter=lifter, policy=policy, on_step=film or None)
        )
        for attempt in run_episode(scene, pipeline, seed=config.seed, max_attempts=config.attempts):
            reporter.add(attempt)
    reporter.finish(time.perf_counter() - start)
    return 0


def main() -> None:
    """Entry point of the command line."""
    run_command(RunConfig, run, description=__doc__ or "")


if __name__ == "__main__":
    sys.exit(main())
