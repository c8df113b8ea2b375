"""The paper's tables as they were published: success in per cent (table 2: 0 to 1), planning steps.

None stands where the paper has no figure. Its table 3 has the same figures as its table 1 for SR,
and adds BASE and SR-A. Nothing here was measured by this project.
"""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Published:
    """One method on one task: tables 1 and 3.

    Attributes:
        task: grasp, place or pick-place.
        method: As the paper calls it.
        seen: Success on seen objects, per cent.
        seen_steps: Planning steps there.
        unseen: Success on unseen objects, per cent.
        unseen_steps: Planning steps there.
        policy: Our policy of the same kind; None where there is none.
    """

    task: str
    method: str
    seen: float
    unseen: float
    seen_steps: float | None = None
    unseen_steps: float | None = None
    policy: str | None = None


def _grasp(
    method: str, seen: float, seen_steps: float, unseen: float, unseen_steps: float, policy: str
) -> Published:
    return Published(
        task="grasp",
        method=method,
        seen=seen,
        seen_steps=seen_steps,
        unseen=unseen,
        unseen_steps=unseen_steps,
        policy=policy or None,
    )


def _place(method: str, seen: float, unseen: float, policy: str) -> Published:
    return Published(task="place", method=method, seen=seen, unseen=unseen, policy=policy)


def _both(
    method: str,
    seen: float,
    seen_steps: float | None,
    unseen: float,
    unseen_steps: float | None,
    policy: str,
) -> Published:
    return Published(
        task="pick-place",
        method=method,
        seen=seen,
        seen_steps=seen_steps,
        unseen=unseen,
        unseen_steps=unseen_steps,
        policy=policy or None,
    )


TABLE_1 = (
    _grasp("CLIPort-Grounding", 59.3, 4.8, 64.0, 4.15, "clip-grounding"),
    _grasp("Raw Image", 48.1, 4.35, 45.3, 5.37, "raw-image"),
    _grasp("Raw Image Grids", 60.7, 4.35, 70.7, 3.49, "raw-image-grid"),
    _grasp("LERF-TOGO", 83.3, 3.37, 76.2, 2.01, "lerf-togo"),
    _grasp("GraspSplats", 58.0, 2.05, 37.3, 1.67, ""),
    _grasp("VLG", 74.3, 4.11, 78.7, 3.98, "vlg"),
    _grasp("ThinkGrasp", 84.7, 2.55, 57.3, 4.11, "think-grasp"),
    _grasp("A²", 90.5, 2.68, 84.2, 3.82, "a2"),
    _grasp("SR", 92.0, 2.34, 92.4, 2.50, "sr"),
    _place("VLP", 40.0, 20.0, "vlp"),
    _place("A²", 66.3, 44.4, "a2"),
    _place("SR", 70.5, 48.8, "sr"),
    _both("Act3D", 0.0, None, 0.0, None, ""),
    _both("RVT-2", 0.83, 4.00, 0.0, None, ""),
    _both("3D Diffuser Actor", 1.67, 6.13, 0.0, None, ""),
    _both("A²", 56.25, 3.12, 42.5, 2.32, "a2"),
    _both("SR", 60.0, 3.45, 50.0, 3.25, "sr"),
)

TABLE_3 = (
    _grasp("BASE", 90.7, 2.43, 80.3, 3.21, "base"),
    _grasp("SR-A", 94.1, 2.49, 76.2, 4.02, "sr-a"),
    _grasp("SR", 92.0, 2.34, 92.4, 2.50, "sr"),
    _place("BASE", 59.0, 38.0, "base"),
    _place("SR-A", 66.9, 32.2, "sr-a"),
    _place("SR", 70.5, 48.8, "sr"),
    _both("BASE", 55.20, 3.23, 40.5, 3.66, "base"),
    _both("SR-A", 66.25, 2.32, 37.5, 4.37, "sr-a"),
    _both("SR", 60.0, 3.45, 50.0, 3.25, "sr"),
)

TABLE_2 = {
    "I need a fruit": (0.9, 3.3, 2.77778, 0.241599),
    "Get something to hold other things": (1.0, 1.2, 1.2, 0.968692),
    "Give me the pear": (1.0, 3.1, 3.1, 0.369404),
    "Give me the thera_med": (1.0, 5.3, 5.3, 0.161902),
    "I need a cup": (1.0, 1.1, 1.1, 0.981099),
    "Grasp a round object": (1.0, 1.1, 1.1, 0.835258),
    "Get something to drink": (1.0, 1.4, 1.4, 0.945054),
    "I want a round object": (0.9, 2.6, 2.0, 0.654881),
    "Get something to eat": (1.0, 1.3, 1.3, 0.958561),
    "Give me the cup": (0.9, 3.7, 3.22222, 0.467884),
}
"""SR by instruction: success (0 to 1), steps, steps of successes, reward."""

TABLE_4 = {
    "ReLU": (("relu",), (84.3, 77.1, 66.4)),
    "Softmax": (("softmax",), (83.5, 74.8, 70.2)),
    "ReLU²": (("relu2", "sr"), (86.7, 78.1, 71.3)),
}
"""Unseen grasping under noise of points by sparsifier: our policies, light, middle and heavy."""

TABLE_4_LEVELS = {"light": "points-0.1", "middle": "points-0.2", "heavy": "points-0.3"}
"""The conditions of ours that stand for the paper's levels."""


def plain_goal(text: str) -> str:
    """Return an instruction in the form in which ours and the paper's are the same."""
    return text.lower().replace("_", " ").strip()


def kind_of_policy(label: str) -> str:
    """Say which method the results of a policy stand for.

    Args:
        label: Name of a policy, with the stem of a checkpoint's file or without.

    Returns:
        In the spelling of `Published.policy`: "sr@sr_a" and "sr-a" are both "sr-a".
    """
    name, _, stem = label.partition("@")
    return (stem if name == "sr" and stem else name).replace("_", "-")
