"""Does one scene after another, and keeps what is slow to make from one to the next."""

import gc
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

from models.workspace import Workspace
from perception.encoders import load_encoder
from perception.lifter import MultiViewLifter
from policy.demonstrations import write_shard
from sr_mj.assemble import assembled, lifter_config
from sr_mj.collecting.crowds import draw_crowd, task_rng
from sr_mj.collecting.expert import Expert
from sr_mj.collecting.folder import describe_scene, marker, shard_name
from sr_mj.collecting.picking import collect_picks
from sr_mj.collecting.placing import collect_places
from sr_mj.collecting.tasks import SceneTask
from sr_mj.collecting.work import Limits, SceneResult, WorkSetting
from sr_mj.errors import SceneError
from sr_mj.oracle import OraclePolicy
from sr_mj.planning import Planner
from sr_mj.scene import Scene, make_scene


class SceneWorker:
    """Collects demonstrations; the same task gives the same shard, whatever was done before.

    Args:
        setting: What all scenes share.
    """

    def __init__(self, setting: WorkSetting) -> None:
        """Load the encoder."""
        self._limits: Limits = setting.limits
        self._encoder = load_encoder(setting.encoder, allow_download=setting.allow_download)
        self._planner = Planner()
        self._lifters: dict[Workspace, MultiViewLifter] = {}

    def __call__(self, task: SceneTask) -> SceneResult:
        """Collect what one scene gives.

        Args:
            task: The scene.

        Returns:
            What came of it, with the file to keep.
        """
        start, cpu_start = time.perf_counter(), time.process_time()
        crowd_rng, expert_rng, goal_rng = task_rng(task).spawn(3)
        stored, reasons = Counter[str](), Counter[str]()
        try:
            scene = make_scene(draw_crowd(task, crowd_rng))
        except SceneError:
            reasons["no_scene"] += 1
            name, content = marker(task, reasons)
        else:
            expert = self._collect(task, scene, expert_rng, goal_rng)
            stored.update(decision.phase for _, decision in expert.decisions)
            reasons.update(expert.reasons)
            name, content = self._packed(task, expert)
        # Trees of scenes hold themselves, and much memory, until they are collected.
        gc.collect()
        return SceneResult(
            task=task,
            file_name=name,
            content=content,
            stored=dict(stored),
            reasons=dict(reasons),
            seconds=time.perf_counter() - start,
            cpu_seconds=time.process_time() - cpu_start,
        )

    def _collect(
        self,
        task: SceneTask,
        scene: Scene,
        expert_rng: np.random.Generator,
        goal_rng: np.random.Generator,
    ) -> Expert:
        limits = self._limits
        with assembled(
            scene, lifter=self._lifter(scene), policy=OraclePolicy(scene), planner=self._planner
        ) as pipeline:
            expert = Expert(scene, pipeline, expert_rng)
            if task.phase == "pick":
                collect_picks(
                    expert,
                    task.seed,
                    goal_rng,
                    num_looks=limits.num_looks,
                    num_goals=limits.num_picks,
                )
            else:
                collect_places(
                    expert,
                    task.seed,
                    goal_rng,
                    num_rounds=limits.num_rounds,
                    num_goals=limits.num_places,
                )
        return expert

    def _packed(self, task: SceneTask, expert: Expert) -> tuple[str, bytes]:
        """Return name and content of the scene's file."""
        if not expert.decisions:
            return marker(task, expert.reasons)
        meta = {"encoder": self._encoder.fingerprint} | describe_scene(task, expert.scene)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / shard_name(task)
            write_shard(path, meta, expert.looks, expert.decisions)
            return path.name, path.read_bytes()

    def _lifter(self, scene: Scene) -> MultiViewLifter:
        workspace = scene.workspace
        if workspace not in self._lifters:
            self._lifters[workspace] = MultiViewLifter(self._encoder, lifter_config(workspace))
        return self._lifters[workspace]


def make_worker(setting: WorkSetting) -> SceneWorker:
    """Prepare this process, and make a worker in it.

    Args:
        setting: What all scenes share.

    Returns:
        The worker.
    """
    import torch

    torch.set_num_threads(1)
    return SceneWorker(setting)
