"""Runs one episode after another, and keeps what is slow to make from one to the next."""

import time
import traceback
from collections import Counter
from contextlib import ExitStack
from dataclasses import replace

from models.arrangements.paraphrases import paraphrases
from models.workspace import Workspace
from perception.encoders import load_encoder
from perception.encoders.base import Encoder
from perception.lifter import MultiViewLifter
from policy.base import Policy
from policy.baselines.random import RandomPolicy
from sr_mj.account import episode_record
from sr_mj.assemble import assembled, lifter_config
from sr_mj.attempt import Attempt
from sr_mj.beginning import Beginning
from sr_mj.candidates.external import load_generator
from sr_mj.candidates.generator import CandidateGenerator
from sr_mj.episode import run_episode
from sr_mj.evaluation.blank import BlankEncoder
from sr_mj.evaluation.conditions import read_condition
from sr_mj.evaluation.identity import Identity
from sr_mj.evaluation.lines import Done, result_line
from sr_mj.evaluation.noisy import NoisyPoints
from sr_mj.evaluation.plan import Episode
from sr_mj.evaluation.setting import BLANK, Setting, load_choice
from sr_mj.evaluation.shared import SharedScene
from sr_mj.evaluation.snapshots import save_snapshots
from sr_mj.oracle import OraclePolicy
from sr_mj.pipeline import Pipeline
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
        self._shared: SharedScene | None = None
        self._open = ExitStack()

    def run(self, episode: Episode) -> Done:
        """Run an episode. An exception ends it as a failure, and is told in its record.

        Scene, hand-over and first look are kept for the next episode, if it begins alike; seconds
        are those that the episode would have taken alone.
        """
        start, before_s = time.perf_counter(), 0.0
        attempts: list[Attempt] = []
        scene, pipeline, error, trace = None, None, None, None
        try:
            shared = self._shared_scene(episode)
            scene = shared.scene
            encoder = self._setting.encoder_for(episode.policy)
            perturbation = read_condition(episode.condition).perturbation()
            policy = self._policy(episode, scene)
            pipeline, beginning = shared.begin(encoder, policy, perturbation)
            before_s, start = shared.seconds(encoder), time.perf_counter()
            self._act(episode, scene, pipeline, beginning, attempts)
        except Exception as exception:
            error = _in_one_line(exception)
            trace = traceback.format_exc()
            # What broke may have left it half changed.
            self._leave()
        seconds = Counter({"total": before_s + time.perf_counter() - start})
        for attempt in attempts:
            seconds.update(attempt.seconds)
        told = {} if scene is None else episode_record(scene, attempts, self._setting.attempts)
        lost = None
        if scene is not None and pipeline is not None and error is None:
            lost = self._picture(episode, scene, pipeline, attempts)
        return Done(
            episode=episode,
            record=result_line(episode, self._setting, self._identity, told, error),
            seconds={name: round(value, 3) for name, value in seconds.items()},
            traceback=trace,
            lost_pictures=lost,
        )

    def _shared_scene(self, episode: Episode) -> SharedScene:
        """Return the scene of the last episode if this one begins alike, else a new one."""
        if self._shared is not None and self._shared.fits(episode):
            return self._shared
        self._leave()
        start = time.perf_counter()
        setting, condition = self._setting, read_condition(episode.condition)
        if self._generator is None:
            self._generator = load_generator(setting.generator)
        scene = self._make_scene(episode)

        def lifter(encoder: str) -> MultiViewLifter:
            return self._lifter(scene.workspace, encoder)

        pipeline = self._open.enter_context(
            assembled(
                scene,
                lifter=lifter(BLANK),
                policy=RandomPolicy(),
                generator=self._generator,
                planner=self._planner,
                keep_unreachable=setting.keep_unreachable,
            )
        )
        self._shared = SharedScene(
            episode,
            scene,
            replace(pipeline, noise=condition.sensor_noise()),
            lifter=lifter,
            max_attempts=setting.attempts,
            made_s=time.perf_counter() - start,
        )
        return self._shared

    def _leave(self) -> None:
        """Free the last scene and its renderer."""
        self._open.close()
        self._shared = None

    def _make_scene(self, episode: Episode) -> Scene:
        setting = self._setting
        if not episode.is_arranged:
            if (maker := setting.scene_makers.get(episode.scene)) is not None:
                return maker(episode)
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

    def _act(
        self,
        episode: Episode,
        scene: Scene,
        pipeline: Pipeline,
        beginning: Beginning,
        attempts: list[Attempt],
    ) -> None:
        """Append the episode's attempts as they end."""
        setting = self._setting
        for attempt in run_episode(
            scene,
            pipeline,
            seed=episode.seed,
            max_attempts=setting.attempts,
            beginning=beginning,
        ):
            attempts.append(attempt)

    def _picture(
        self, episode: Episode, scene: Scene, pipeline: Pipeline, attempts: list[Attempt]
    ) -> str | None:
        """Keep pictures of an episode that has just ended, if asked for; say why if they are lost.

        They are no part of the result: a full disk must not turn a success into a failure.
        """
        setting = self._setting
        if setting.pictures is None or episode.seed not in setting.picture_seeds:
            return None
        try:
            save_snapshots(scene, pipeline, attempts, setting.pictures / episode.key)
        except Exception as exception:
            # What broke may be the renderer, which the next episode must not get.
            self._leave()
            return _in_one_line(exception)
        return None

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

    def _policy(self, episode: Episode, scene: Scene) -> Policy:
        label, condition = episode.policy, read_condition(episode.condition)
        choice = self._setting.choice(label)
        if choice.name == OraclePolicy.name:
            return OraclePolicy(scene)
        if label not in self._policies:
            self._policies[label] = load_choice(choice, self._setting.encoder_fingerprints)
        policy = self._policies[label]
        return NoisyPoints(policy, condition.point_sigma) if condition.point_sigma else policy


def _in_one_line(exception: Exception) -> str:
    return f"{type(exception).__name__}: {exception}".splitlines()[0]
