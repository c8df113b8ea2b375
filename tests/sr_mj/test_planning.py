import itertools

import numpy as np
import pytest

from models.tabletop import BIN_CENTER
from models.ur5 import HOME_QPOS
from policy.actions import ActionCandidates
from sr_mj.planning import PICK_PHASES, Phase, Planner, PlannerConfig, straight_poses
from sr_mj.planning.body import GripperBody, RobotBody
from sr_mj.planning.obstacles import find_obstacles


@pytest.fixture(scope="module")
def planner():
    return Planner()


@pytest.fixture(scope="module")
def near(pose_down):
    """A grasp within reach."""
    return pose_down(0.5, 0.1, 0.05, 0.4)


@pytest.fixture(scope="module")
def far(pose_down):
    return pose_down(1.6, 0, 0.1)


@pytest.fixture(scope="module")
def cage(block):
    """Stands between home and the grasp; the direct way leads through it."""
    walls = [
        ((0.40, -0.02, 0.01), (0.60, -0.01, 0.35)),
        ((0.40, 0.21, 0.01), (0.60, 0.22, 0.35)),
        ((0.61, -0.02, 0.01), (0.62, 0.22, 0.35)),
    ]
    return np.concatenate([block(*wall) for wall in walls])


def candidates(*poses, width_m=0.05):
    num = len(poses)
    return ActionCandidates(
        kind="pick",
        Ts_world_tool=np.array(poses).reshape(num, 4, 4),
        width_m=np.full(num, width_m, np.float32),
        prior=np.ones(num, np.float32),
    )


def by_phase(plan):
    return {segment.phase: segment.trajectory for segment in plan.segments}


def nearest_point_m(planner, trajectory, points):
    """Least distance of links and gripper to points along a motion, by exact shapes."""
    postures = trajectory.path(np.linspace(0, 1, 120))
    placed = planner._body.place(postures)
    centers = placed.centers.reshape(-1, 3)
    radii = np.tile(planner._body.radius_m, len(postures))
    gaps = np.linalg.norm(points[:, None] - centers, axis=2) - radii
    low, half = GripperBody().boxes
    local = np.einsum("mpi,mij->mpj", points - placed.position[:, None], placed.rotation)
    outside = np.abs(local[:, :, None] - low) - half
    boxes = np.linalg.norm(outside.clip(0), axis=-1) + outside.max(axis=-1).clip(max=0)
    return min(gaps.min(), boxes.min())


FIRST = np.array([0])


def test_phases_follow_each_other_without_a_jump(planner, near):
    plan = planner.plan(candidates(near), FIRST, shake_off=True)
    assert plan.kind == "pick"
    assert tuple(segment.phase for segment in plan.segments) == PICK_PHASES
    moves = [s.trajectory for s in plan.segments if s.trajectory is not None]
    np.testing.assert_allclose(moves[0].start, HOME_QPOS)
    np.testing.assert_allclose(moves[-1].end, HOME_QPOS)
    for before, after in itertools.pairwise(moves):
        np.testing.assert_allclose(before.end, after.start, atol=1e-12)


def test_approach_is_straight_and_lift_is_vertical(planner, near):
    moves = by_phase(planner.plan(candidates(near), FIRST))

    def positions(phase):
        path = moves[phase].path(np.linspace(0, 1, 60))
        return np.array([planner.kinematics.tool_pose(q)[:3, 3] for q in path])

    approach, lift = positions(Phase.APPROACH), positions(Phase.LIFT)
    for path in (approach, lift):
        np.testing.assert_allclose(path[:, :2], np.tile([0.5, 0.1], (60, 1)), atol=2e-3)
    assert approach[0, 2] == pytest.approx(0.05 + planner.config.approach_m, abs=1e-3)
    np.testing.assert_allclose(approach[-1], near[:3, 3], atol=1e-3)
    assert lift[-1, 2] == pytest.approx(0.05 + planner.config.lift_m, abs=1e-3)


def test_goes_high_when_nobody_knows_what_stands_on_the_table(planner, near):
    transit = by_phase(planner.plan(candidates(near), FIRST))[Phase.TRANSIT]
    path = np.array(
        [planner.kinematics.tool_pose(q)[:3, 3] for q in transit.path(np.linspace(0, 1, 200))]
    )
    aside = np.linalg.norm(path[:, :2] - near[:2, 3], axis=1) > 0.05
    assert path[aside, 2].min() > planner.config.transit_height_m - 0.04


def test_releases_over_the_bin(planner, near):
    carry = by_phase(planner.plan(candidates(near), FIRST))[Phase.CARRY]
    position = planner.kinematics.tool_pose(carry.end)[:3, 3]
    np.testing.assert_allclose(position[:2], BIN_CENTER[:2], atol=1e-3)


def test_tilts_on_the_spot_about_the_line_through_both_pads(planner, near):
    tilt = by_phase(planner.plan(candidates(near), FIRST, shake_off=True))[Phase.TILT]
    np.testing.assert_allclose(tilt.end, tilt.start, atol=1e-12)
    path = tilt.path(np.linspace(0, 1, 101))
    poses = np.array([planner.kinematics.tool_pose(posture) for posture in path])
    np.testing.assert_allclose(poses[:, :3, 3], np.tile(poses[0, :3, 3], (101, 1)), atol=2e-3)
    np.testing.assert_allclose(poses[:, :3, 0], np.tile(poses[0, :3, 0], (101, 1)), atol=5e-3)
    assert np.arccos(-poses[:, 2, 2]).max() == pytest.approx(planner.config.tilt_rad, abs=5e-3)
    assert (planner._body.is_free(path)).all()


def test_a_tilt_that_the_arm_cannot_reach_is_left_out(near):
    config = PlannerConfig(tilt_rad=2.5)
    planner, phases = Planner(config), set(PICK_PHASES) - {Phase.TILT}
    assert set(by_phase(planner.plan(candidates(near), FIRST, shake_off=True))) == phases
    # Nor is it there unless asked for.
    assert set(by_phase(Planner().plan(candidates(near), FIRST))) == phases


def test_every_motion_keeps_the_limits(planner, near):
    plan = planner.plan(candidates(near), FIRST)
    for trajectory in filter(None, by_phase(plan).values()):
        times = np.linspace(0, trajectory.duration_s, 2000)
        _, qvel = trajectory.sample(times)
        qacc = np.gradient(qvel, times, axis=0)
        assert np.abs(qvel).max() <= planner.config.limits.speed
        assert np.abs(qacc[2:-2]).max() <= planner.config.limits.acceleration


@pytest.mark.parametrize(("width_m", "opening"), [(0.03, 0.05), (0.08, 0.085)])
def test_opens_wider_than_the_contact_up_to_the_stroke(planner, width_m, opening, near):
    plan = planner.plan(candidates(near, width_m=width_m), FIRST)
    assert plan.segments[0].width_m == pytest.approx(opening, abs=1e-6)


def test_takes_the_first_candidate_that_can_be_reached(planner, near, far):
    plan = planner.plan(candidates(far, near, near), np.array([0, 2, 1]))
    assert plan.chosen == 2


def test_what_cannot_be_reached_is_not_counted_as_tried(planner, near, far):
    many = 2 * planner.config.num_tried + 5
    plan = planner.plan(candidates(*[far] * many, near), np.arange(many + 1))
    assert plan is not None and plan.chosen == many


def test_nothing_reachable_is_no_plan(planner, far, pose_down):
    assert planner.plan(candidates(far), FIRST) is None
    assert planner.plan(candidates(), np.array([], int)) is None
    assert planner.plan(candidates(pose_down(0.5, 0, -0.03)), FIRST) is None


def test_verdict_of_a_batch_is_that_of_each_plan(planner, pose_down):
    rng = np.random.default_rng(3)
    poses = [pose_down(*rng.uniform([0.2, -0.4, 0.0], [1.0, 0.4, 0.1]), rng.uniform(0, 3))
             for _ in range(60)]  # fmt: skip
    verdicts = planner.reachable(candidates(*poses))
    assert 10 < verdicts.sum() < 50
    for pose, verdict in zip(poses, verdicts, strict=True):
        assert (planner.plan(candidates(pose), FIRST) is not None) == verdict
    assert planner.reachable(candidates()).shape == (0,)


def test_every_vertical_grasp_in_the_workspace_is_reachable(planner, pose_down):
    grid = itertools.product(
        np.linspace(0.29, 0.71, 4), np.linspace(-0.21, 0.21, 4), [0.03], np.radians([0, 45, 90])
    )
    assert planner.reachable(candidates(*(pose_down(*place) for place in grid))).all()


def test_links_that_would_sink_into_the_cloud_are_unreachable(planner, near, block):
    wall = block((0.3, -0.2, 0.3), (0.6, 0.2, 0.5), 0.01)
    grasps = candidates(near)
    assert planner.reachable(grasps)[0]
    assert not planner.reachable(grasps, obstacles=wall)[0]


def test_free_table_needs_no_search_and_no_detour(planner, near, block):
    cloud = block((0.3, -0.2, 0.01), (0.36, -0.14, 0.05))
    plan = planner.plan(candidates(near), FIRST, obstacles=cloud)
    assert plan.searched == ()
    low, high = by_phase(plan), by_phase(planner.plan(candidates(near), FIRST))
    assert low[Phase.TRANSIT].duration_s < high[Phase.TRANSIT].duration_s


def test_searches_a_way_around_what_bars_all_others(planner, near, cage):
    plan = planner.plan(candidates(near), FIRST, obstacles=cage)
    assert plan.searched
    for phase, trajectory in by_phase(plan).items():
        if trajectory is not None:
            assert nearest_point_m(planner, trajectory, cage[::3]) > 0, phase


def test_the_same_question_gets_the_same_searched_path(planner, near, cage):
    first, second = (planner.plan(candidates(near), FIRST, obstacles=cage) for _ in range(2))
    for a, b in zip(first.segments, second.segments, strict=True):
        if a.trajectory is not None:
            np.testing.assert_array_equal(a.trajectory.path.c, b.trajectory.path.c)


def test_what_the_fingers_close_on_is_no_obstacle(planner, near, block):
    between = block((0.49, 0.09, 0.01), (0.51, 0.11, 0.06))
    assert planner.plan(candidates(near), FIRST, obstacles=between) is not None


def test_what_the_palm_would_hit_is_an_obstacle(planner, near, block):
    tall = block((0.47, 0.07, 0.01), (0.53, 0.13, 0.2))
    assert planner.plan(candidates(near), FIRST, obstacles=tall) is None


def test_points_of_the_table_are_no_obstacle(planner):
    table = np.random.default_rng(0).uniform([0.3, -0.2, -0.003], [0.7, 0.2, 0.003], (5000, 3))
    assert find_obstacles(table) is None
    assert find_obstacles(np.zeros((0, 3))) is None and find_obstacles(None) is None


def test_the_distance_field_is_within_a_voxel_of_the_truth():
    rng = np.random.default_rng(0)
    points = rng.uniform([0.3, -0.2, 0.01], [0.7, 0.2, 0.15], (300, 3)).astype(np.float32)
    obstacles = find_obstacles(points)
    asked = rng.uniform([0.25, -0.25, 0.0], [0.75, 0.25, 0.2], (2000, 3))
    true = np.linalg.norm(asked[:, None] - obstacles.points, axis=2).min(axis=1)
    assert np.abs(obstacles.distances(asked) - true).max() < 0.01


def test_the_gripper_is_covered_by_its_spheres_and_not_by_much():
    gripper = GripperBody()
    centers, radii = gripper.spheres
    low, half = gripper.boxes
    rng = np.random.default_rng(0)
    face = rng.integers(3, size=3000)
    inside = rng.uniform(-1, 1, (3000, 3))
    inside[np.arange(3000), face] = np.sign(inside[np.arange(3000), face])
    surface = (low[:, None] + inside * half[:, None]).reshape(-1, 3)
    gaps = np.linalg.norm(surface[:, None] - centers, axis=2) - radii
    assert gaps.min(axis=1).max() < 1e-9
    outside = np.abs(centers[:, None] - low) - half
    assert (radii[:, None] + outside.max(axis=2)).min(axis=1).max() < 0.01


def test_a_link_sphere_stands_where_mujoco_puts_the_link():
    body = RobotBody()
    placed = body.place(HOME_QPOS[None])
    assert placed.is_free.all() and body.is_free(HOME_QPOS[None]).all()
    assert not body.is_free(np.zeros((1, 6))).any()
    # The wrist's last sphere is at the end of the tool's axis, the flange's side.
    behind = placed.centers[0, -1] - placed.position[0]
    assert behind @ placed.rotation[0, :, 2] < -0.145


def test_straight_poses_are_evenly_spaced(near, pose_down):
    end = pose_down(0.5, 0.1, 0.15, 1.0)
    poses = straight_poses(near, end, 0.01)
    np.testing.assert_allclose(poses[0], near, atol=1e-12)
    np.testing.assert_allclose(poses[-1], end, atol=1e-12)
    gaps = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1)
    assert gaps.max() <= 0.01 + 1e-9
    np.testing.assert_allclose(gaps, gaps[0])
