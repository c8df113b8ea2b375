"""The stages of the system, put together."""

import zlib
from dataclasses import dataclass, replace

import numpy as np

from perception.lifter import MultiViewLifter, Percept
from perception.views import CameraView
from policy.base import Policy
from policy.images import ImageSource
from policy.observation import Observation
from sr_mj.candidates.generator import CandidateGenerator, PlaceGenerator
from sr_mj.execution import Executor
from sr_mj.instruction import PhaseText
from sr_mj.perturbation import PosePerturbation
from sr_mj.planning import Planner
from sr_mj.planning.body import RobotBody
from sr_mj.scene import Scene
from sr_mj.self_filter import hide_robot
from sr_mj.sensors.capture import capture_views
from sr_mj.sensors.l515 import L515NoiseConfig
from sr_mj.sensors.renderer import CameraRig

# Keep what is drawn for one purpose apart from what the same seed draws for another.
_ERRORS_OF_POSES = 1_700_013
_IN_RANDOM_SCENES = 1_700_021


@dataclass(frozen=True, kw_only=True)
class Pipeline:
    """The stages of the system, each exchangeable for another with the same interface.

    Attributes:
        rig: Cameras on the scene.
        noise: Sensor noise.
        lifter: Views and instruction to clouds.
        generator: Cloud to grasp candidates.
        placer: Cloud and what is held to place candidates.
        policy: Candidates to scores.
        planner: Chosen candidate to plan.
        executor: Plan to outcome.
        robot: Says where the robot is in the views, which is taken out of them.
        perturbation: Error of the executed pose; None for none.
        keep_unreachable: Leave candidates that the arm cannot reach to the policy, as the paper
            does; if it chooses one, the attempt is lost. Otherwise they are left out, and if the
            first choice cannot be executed after all, the next one is tried.
        shakes_off: Whether what is to be placed is tilted over the bin first, since what lies on it
            would be put down with it.
    """

    rig: CameraRig
    noise: L515NoiseConfig
    lifter: MultiViewLifter
    generator: CandidateGenerator
    placer: PlaceGenerator
    policy: Policy
    planner: Planner
    executor: Executor
    robot: RobotBody
    perturbation: PosePerturbation | None = None
    keep_unreachable: bool = False
    shakes_off: bool = True

    def handing_over(self, policy: Policy) -> "Pipeline":
        """Return the stages with which a policy picks what others then place: nothing errs."""
        return replace(
            self, policy=policy, perturbation=None, keep_unreachable=False, shakes_off=False
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class EpisodeRngs:
    """One source of randomness a stage, so that a change of one leaves the others' draws alone.

    Attributes:
        noise: Sensor noise.
        candidates: Candidate generators.
        policy: Policy.
        perturbation: Errors of executed poses.
    """

    noise: np.random.Generator
    candidates: np.random.Generator
    policy: np.random.Generator
    perturbation: np.random.Generator

    @classmethod
    def of_episode(cls, scene: Scene, seed: int) -> "EpisodeRngs":
        """Derive all of them from a seed; errors of poses from the scene as well.

        An episode draws one such error, or a few: with the same ones in every scene, many episodes
        would tell no more than one. In a scene that was drawn at random, commonly from the same
        seed, nothing is drawn from the stream that drew the scene.
        """
        drawn = scene.config.arranged is None
        words = [_IN_RANDOM_SCENES, seed] if drawn else [seed]
        noise, candidates, policy = np.random.default_rng(words).spawn(3)
        words = (_ERRORS_OF_POSES, seed, zlib.crc32(scene.config.title.encode()))
        perturbation = np.random.default_rng(words)
        return cls(noise=noise, candidates=candidates, policy=policy, perturbation=perturbation)


def look(scene: Scene, pipeline: Pipeline, rng: np.random.Generator) -> tuple[CameraView, ...]:
    """Take a view with every camera, the robot left out.

    Args:
        scene: The scene.
        pipeline: The stages.
        rng: Sensor noise.

    Returns:
        The views.
    """
    views = capture_views(pipeline.rig, scene.data, pipeline.noise, rng)
    return hide_robot(views, pipeline.robot, pipeline.executor.drive.arm_qpos, scene.workspace)


def observe(
    percept: Percept, scene: Scene, text: PhaseText, images: ImageSource | None = None
) -> Observation:
    """Reduce a percept to what a policy may see: arrays of the cloud and the instruction.

    Args:
        percept: What was perceived with respect to `text`.
        scene: For its workspace; nothing else is read.
        text: What the instruction says about this phase.
        images: The pictures that were perceived; described only if the policy asks for them.

    Returns:
        The observation.
    """
    cloud = percept.features
    return Observation(
        points=cloud.points,
        features=cloud.features,
        similarity=cloud.similarity,
        confidence=cloud.confidence,
        text_tokens=percept.text.tokens,
        text_pooled=percept.text.pooled,
        phrase_pooled=percept.target_text.pooled,
        workspace_min=np.array(scene.workspace.lower),
        workspace_max=np.array(scene.workspace.upper),
        phase=text.phase,
        relation=text.relation,
        side=text.side,
        images=images,
    )
