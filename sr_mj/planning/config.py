"""Settings of the planner."""

from dataclasses import dataclass, field

from sr_mj.trajectory import MotionLimits


@dataclass(frozen=True, kw_only=True)
class SearchConfig:
    """Settings of the sampling planner.

    Attributes:
        max_samples: Samples after which it gives up; bounds the run time.
        step_rad: Largest joint motion by which a tree grows at once.
        reach_rad: Samples are drawn this far around the joint angles of both ends.
        num_shortcuts: Attempts to cut the path short.
        max_searches: Most searches for one decision.
        seed: Seed of the samples: the same question gets the same path.
    """

    max_samples: int = 150
    step_rad: float = 0.5
    reach_rad: float = 0.9
    num_shortcuts: int = 40
    max_searches: int = 4
    seed: int = 0


@dataclass(frozen=True, kw_only=True)
class PlannerConfig:
    """Geometry and speed of picks and placements.

    Attributes:
        approach_m: Length of the straight approach to a grasp, and of the straight way down to a
            place and back from it.
        extra_width_m: How much wider than the contact width the fingers open for the approach.
        transit_height_m: Height of the tool over which the arm swings where the direct way is not
            free, and always when there is no cloud to check the direct way against.
        lift_m: How far a grasped object is lifted straight up.
        carry_height_m: Height of the tool over the bin.
        tilt_rad: How far what is to be placed is tilted over the bin, rad. What lies on it slides
            off: objects have friction 0.7, which holds up to 0.61 rad.
        step_m: Distance between waypoints of a straight path.
        max_joint_step: Largest joint motion between these waypoints, rad; more means that the
            arm would flip from one IK branch to another.
        check_step_rad: Largest joint motion between two collision checks of a free path.
        margin_m: Distance from the cloud's points that free motions keep, where their ends do.
        least_margin_m: Least distance by the spheres, which are up to 10 mm larger than the
            gripper; an end of a motion that is nearer is rejected.
        touch_m: How far cloud points may reach into gripper and wrist on the straight ways; the
            cloud's own thickness.
        settle_m: Height over its place below which a held object may touch the cloud.
        num_tried: Candidates with a good verdict that are planned, best first, until one has a
            plan.
        limits: Joint limits for free motion.
        approach_speed: Fraction of the limits for the straight ways.
        carry_speed: Fraction of the limits while an object is held.
        search: Settings of the sampling planner.
    """

    approach_m: float = 0.10
    extra_width_m: float = 0.02
    transit_height_m: float = 0.28
    lift_m: float = 0.20
    carry_height_m: float = 0.32
    tilt_rad: float = 1.05
    step_m: float = 0.01
    max_joint_step: float = 0.35
    check_step_rad: float = 0.05
    margin_m: float = 0.01
    least_margin_m: float = -0.012
    touch_m: float = 0.003
    settle_m: float = 0.012
    num_tried: int = 12
    limits: MotionLimits = field(default_factory=MotionLimits)
    approach_speed: float = 0.5
    carry_speed: float = 0.7
    search: SearchConfig = field(default_factory=SearchConfig)
