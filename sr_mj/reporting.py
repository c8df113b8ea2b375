"""Prints the account of an episode as it happens, and keeps it in a folder."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sr_mj.account import (
    attempt_record,
    describe_attempt,
    describe_result,
    describe_scene,
    episode_record,
)
from sr_mj.attempt import Attempt
from sr_mj.pictures import save_pictures
from sr_mj.provenance import git_revision, package_versions, to_json
from sr_mj.scene import Scene

if TYPE_CHECKING:
    from sr_mj.run import RunConfig


class Reporter:
    """Tells of one episode.

    Args:
        config: Options of the run.
        scene: The scene.
        out: Folder for what is kept; None for nothing.
    """

    def __init__(self, config: "RunConfig", scene: Scene, out: Path | None) -> None:
        """Begin with no attempts."""
        self._config, self._scene, self._out = config, scene, out
        self.attempts: list[Attempt] = []

    def begin(self) -> None:
        """Tell what is going to be done, and with what."""
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

    def add(self, attempt: Attempt) -> None:
        """Tell of an attempt."""
        self.attempts.append(attempt)
        if not self._config.json:
            print(describe_attempt(attempt, verbose=self._config.verbose), flush=True)
        if self._out is not None:
            with (self._out / "attempts.jsonl").open("a") as file:
                file.write(json.dumps(attempt_record(attempt)) + "\n")
            save_pictures(attempt, self._out)

    def finish(self, seconds: float) -> None:
        """Tell how the episode ended, after so many seconds of wall time."""
        record: dict[str, Any] = episode_record(self._scene, self.attempts, self._config.attempts)
        record["seconds"] = round(seconds, 2)
        if self._out is not None:
            (self._out / "result.json").write_text(json.dumps(record, indent=2) + "\n")
        if self._config.json:
            print(json.dumps(record))
        else:
            result = describe_result(self._scene, self.attempts, self._config.attempts)
            print(f"{result} [{seconds:.1f} s]")
