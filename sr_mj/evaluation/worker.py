"""Runs one episode after another, and keeps what is slow to make from one to the next."""

import time
import traceback
from collections import Counter
from dataclasses import replace

from models.arrangements.paraphrases import paraphrases
from models.workspace import Workspace
from perception.encoders import load_encoder
from perception.encoders.base import Encoder
from perception.lifter import MultiViewLifter
from policy.base import Policy
from sr_mj.account import episode_record
from sr_mj.assemble import assembled, lifter_config
from sr_mj.attempt import Attempt
from sr_mj.candidates.external import load_generator
from sr_mj.candidates.generator import CandidateGenerator
from sr_mj.episode import run_episode
from sr_mj.evaluation.blank import BlankEncoder
from sr_mj.evaluation.conditions import Condition, read_condition
from sr_mj.evaluation.lines import Done, result_line
from sr_mj.evaluation.noisy import NoisyPoints
from sr_mj.evaluation.plan import Episode
from sr_mj.evaluation.setting import BLANK, Identity, Setting, load_choice
from sr_mj.evaluation.snapshots import save_snapshots
from sr_mj.oracle import OraclePolicy
from sr_mj.planning import Planner
from sr_mj.scene import Scene, SceneConfig, make_scene


class Worker:
    """Runs episodes; equal episodes give equal records, whatever ran before.

    Policies are kept from one episode to the next, and must not remember any of them.

    Args:
        setting: What all episodes share.
    """

    def __init__(self, setting: Setting) -> None:
        """Begin with nothing made."""
        self._setting = setting
        self._identity = Identity(setting)
        self._encoders: dict[str, Encoder] = {}
        self._lifters: dict[tuple[Workspace, str], MultiViewLifter] = {}
        self._policies: dict[str, Policy] = {}
        self._generator: CandidateGenerator | None = None
        self._planner = Planner()

    def run(self, episode: Episode) -> Done:
        """Run an episode. An exception ends it as a failure, and is told in its record."""
        start = time.perf_counter()
        attempts: list[Attempt] = []
        scene, error, trace = None, None, None
        try:
            scene = self._make_scene(episode)
            self._act(episode, scene, attempts)
        except Exception as exception:
            error = f"{type(exception).__name__}: {exception}".splitlines()[0]
            trace = traceback.format_exc()
        seconds = Counter({"total": time.perf_counter() - start})
        for attempt in attempts:
            seconds.update(attempt.seconds)
        told = {} if scene is None else episode_record(scene, attempts, self._setting.attempts)
        return Done(
            episode=episode,
            record=result_line(episode, self._setting, self._identity, told, error),
            seconds={name: round(value, 3) for name, value in seconds.items()},
            traceback=trace,
        )

    def _make_scene(self, episode: Episode) -> Scene:
        setting = self._setting
        if not episode.is_arranged:
            if setting.make_random_scene is not None:
                return setting.make_random_scene(episode)
            return make_scene(
                SceneConfig(
                    scene=episode.scene,
                    split="seen" if episode.split == "seen" else "unseen",
                    seed=episode.seed,
                    cameras=setting.cameras,
                )
            )
        scene = make_scene(SceneConfig(arrangement=episode.scene, cameras=setting.cameras))
        if read_condition(episode.condition).is_reworded:
            others = paraphrases(scene.goal.text)
            text = others[episode.seed % len(others)]
            return replace(scene, goal=replace(scene.goal, text=text))
        return scene

    def _act(self, episode: Episode, scene: Scene, attempts: list[Attempt]) -> None:
        setting, condition = self._setting, read_condition(episode.condition)
        if self._generator is None:
            self._generator = load_generator(setting.generator)
        with assembled(
            scene,
            lifter=self._lifter(scene.workspace, setting.encoder_for(episode.policy)),
            policy=self._policy(episode.policy, scene, condition),
            generator=self._generator,
            planner=self._planner,
            perturbation=condition.perturbation(),
            keep_unreachable=setting.keep_unreachable,
        ) as pipeline:
            pipeline = replace(pipeline, noise=condition.sensor_noise())
            for attempt in run_episode(
                scene, pipeline, seed=episode.seed, max_attempts=setting.attempts
            ):
                attempts.append(attempt)
            if setting.pictures is not None and episode.seed in setting.picture_seeds:
                save_snapshots(scene, pipeline, attempts, setting.pictures / episode.key)

    def _lifter(self, workspace: Workspace, encoder: str) -> MultiViewLifter:
        key = (workspace, encoder)
        if key not in self._lifters:
            config = lifter_config(workspace)
            self._lifters[key] = MultiViewLifter(self._encoder(encoder), config)
        return self._lifters[key]

    def _encoder(self, name: str) -> Encoder:
        if name not in self._encoders:
            self._encoders[name] = (
                BlankEncoder()
                if name == BLANK
                else load_encoder(name, allow_download=self._setting.allow_download)
            )
        return self._encoders[name]

    def _policy(self, label: str, scene: Scene, condition: Condition) -> Policy:
        choice = self._setting.choice(label)
        if choice.name == OraclePolicy.name:
            return OraclePolicy(scene)
        if label not in self._policies:
            self._policies[label] = load_choice(choice, self._setting.encoder_fingerprints)
        policy = self._policies[label]
        return NoisyPoints(policy, condition.point_sigma) if condition.point_sigma else policy
