"""Puts the stages together by name, for one scene."""

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from models.cameras import camera_preset
from models.workspace import Workspace
from perception.encoders import load_encoder
from perception.fusion import FusionConfig
from perception.lifter import LifterConfig, MultiViewLifter
from policy.base import Policy
from policy.registry import POLICY_NAMES, load_policy
from sr_mj.candidates.antipodal import AntipodalSampler
from sr_mj.candidates.generator import CandidateGenerator
from sr_mj.candidates.placing import SurfacePlacer
from sr_mj.drive import StepHook
from sr_mj.errors import UnknownNameError, unknown_name_message
from sr_mj.execution import Executor
from sr_mj.oracle import OraclePolicy
from sr_mj.perturbation import PosePerturbation
from sr_mj.pipeline import Pipeline
from sr_mj.planning import Planner
from sr_mj.planning.body import RobotBody
from sr_mj.scene import Scene
from sr_mj.sensors.l515 import L515NoiseConfig
from sr_mj.sensors.renderer import CameraRig

ALL_POLICIES = (*POLICY_NAMES, OraclePolicy.name)


def check_policy_name(name: str) -> None:
    """Refuse the name of a policy that does not exist.

    Args:
        name: The name; valid are those of `ALL_POLICIES`.

    Raises:
        UnknownNameError: If there is no such policy.
    """
    if name not in ALL_POLICIES:
        raise UnknownNameError(
            unknown_name_message("policy", name, ALL_POLICIES).replace("Policys", "Policies")
        )


def make_policy(
    name: str,
    scene: Scene,
    checkpoint: Path | None = None,
    *,
    encoder: Collection[str] | None = None,
) -> Policy:
    """Make a policy by name; `oracle` is the one that may read the scene.

    Args:
        name: One of `ALL_POLICIES`.
        scene: The scene that will be acted in.
        checkpoint: Weights for a learnt policy; those shipped when None.
        encoder: Fingerprints of the encoder in use; a learnt policy must have been trained with one
            of them. None to take any.

    Returns:
        The policy.

    Raises:
        UnknownNameError: If there is no such policy.
        PolicyError: If its weights are missing or were trained on other features.
    """
    check_policy_name(name)
    if name == OraclePolicy.name:
        return OraclePolicy(scene)
    return load_policy(name, checkpoint=checkpoint, encoder=encoder)


def lifter_for(
    workspace: Workspace, encoder: str, *, allow_download: bool = False
) -> MultiViewLifter:
    """Make the perception stage for a workspace.

    Args:
        workspace: The box to look at.
        encoder: Name of the encoder; see `perception.encoders.load_encoder`.
        allow_download: Whether missing weights may be fetched from the hub.

    Returns:
        The lifter.
    """
    return MultiViewLifter(
        load_encoder(encoder, allow_download=allow_download), lifter_config(workspace)
    )


def lifter_config(workspace: Workspace) -> LifterConfig:
    """Configure perception for a workspace, which is all that the cloud then holds.

    Args:
        workspace: The box to look at.

    Returns:
        The configuration.
    """
    x, y, z = workspace.lower
    # A little under the table, so that the noise of the table's own points is not cut in half.
    fusion = FusionConfig(workspace_min=(x, y, z - 0.01), workspace_max=workspace.upper)
    return LifterConfig(fusion=fusion)


@contextmanager
def assembled(
    scene: Scene,
    *,
    lifter: MultiViewLifter,
    policy: Policy,
    generator: CandidateGenerator | None = None,
    planner: Planner | None = None,
    on_step: StepHook | None = None,
    perturbation: PosePerturbation | None = None,
    keep_unreachable: bool = False,
) -> Iterator[Pipeline]:
    """Assemble the stages for a scene; the renderer is freed at the end.

    Args:
        scene: The scene.
        lifter: Perception stage.
        policy: Policy.
        generator: Generator of grasps; the antipodal sampler when None.
        planner: Planner; a new one when None.
        on_step: Called after every simulation step.
        perturbation: Error of executed poses.
        keep_unreachable: Whether candidates that cannot be reached are left to the policy.

    Yields:
        The pipeline.
    """
    with CameraRig(scene.model, camera_preset(scene.config.cameras)) as rig:
        yield Pipeline(
            rig=rig,
            noise=L515NoiseConfig(),
            lifter=lifter,
            generator=generator or AntipodalSampler(),
            placer=SurfacePlacer(),
            policy=policy,
            planner=planner or Planner(),
            executor=Executor(scene, on_step=on_step),
            robot=RobotBody(),
            perturbation=perturbation,
            keep_unreachable=keep_unreachable,
        )
