"""Pictures of what a policy with attention attended to: its semantic mask, branches and scores."""

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from scipy.spatial import KDTree

from perception.heatmap import paint_heatmap
from policy.explanation import ExplainingPolicy, PolicyExplanation
from policy.registry import ATTENTION_POLICIES
from sr_mj.attempt import Attempt
from sr_mj.errors import ConfigError
from sr_mj.instruction import PhaseText, pick_text, place_text
from sr_mj.pipeline import observe
from sr_mj.scene import Scene

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_REACH_M = 0.012
_SIZE_INCHES, _DPI = (16.0, 9.0), 100


def check_explains(policy: str) -> None:
    """Refuse a policy that has no attention to show.

    Args:
        policy: Name of the policy.

    Raises:
        ConfigError: If it has none.
    """
    if policy not in ATTENTION_POLICIES:
        raise ConfigError(
            f"Policy {policy!r} has no attention to show; leave --explain out, or choose "
            f"--policy {' or '.join(ATTENTION_POLICIES)}."
        )


class Explainer:
    """Draws what a policy attended to at every attempt.

    Args:
        policy: The policy that makes the decisions.
        scene: The scene, for its instruction and workspace.
        folder: Folder for the pictures; made if it does not exist.
    """

    def __init__(self, policy: ExplainingPolicy, scene: Scene, folder: Path) -> None:
        """Make the folder."""
        self._policy, self._scene, self._folder = policy, scene, folder
        folder.mkdir(parents=True, exist_ok=True)

    def add(self, attempt: Attempt) -> None:
        """Write `attempt_NN_attention.png` and `.json`, or `place_NN_attention.*` for placing.

        Args:
            attempt: An attempt of the policy's. Of a hand-over, and of one where there was nothing
                to decide, nothing is written.
        """
        if attempt.percept is None or attempt.candidates is None or attempt.is_hand_over:
            return
        text = (place_text if attempt.kind == "place" else pick_text)(self._scene.goal.text)
        observation = observe(attempt.percept, self._scene, text)
        explanation = self._policy.explain(observation, attempt.candidates)
        name = "place" if attempt.kind == "place" else "attempt"
        stem = self._folder / f"{name}_{attempt.index + 1:02d}_attention"
        draw_explanation(attempt, explanation, text).savefig(stem.with_suffix(".png"), dpi=_DPI)
        record = json.dumps(explanation_record(explanation, text), indent=2)
        stem.with_suffix(".json").write_text(record + "\n")


def explanation_record(explanation: PolicyExplanation, text: PhaseText) -> dict[str, object]:
    """Return the figures behind a picture as plain JSON values.

    Args:
        explanation: What the policy attended to.
        text: What it was asked for.

    Returns:
        Instruction, alpha of every layer, logits, and where the mask's mass lies.
    """
    mask = explanation.mean_mask
    center = mask @ explanation.points / max(mask.sum(), 1e-9) if len(mask) else np.zeros(3)
    return {
        "instruction": text.text,
        "phase": text.phase,
        "alpha": [
            {"sparse": round(float(sparse), 4), "dense": round(float(dense), 4)}
            for sparse, dense in explanation.alpha
        ],
        "mask_center_m": [round(float(x), 4) for x in center],
        "logits": [round(float(x), 4) for x in explanation.logits],
    }


def draw_explanation(attempt: Attempt, explanation: PolicyExplanation, text: PhaseText) -> Figure:
    """Draw the mask over the views, and below them the branches' weights and the scores.

    Args:
        attempt: The attempt, with percept and candidates.
        explanation: What the policy attended to.
        text: What it was asked for.

    Returns:
        The figure.
    """
    figure = Figure(figsize=_SIZE_INCHES, layout="constrained")
    figure.suptitle(f"{text.phase}: {text.text!r}")
    rows = figure.subplots(2, max(3, len(attempt.views)))
    for axes, view, picture in zip(
        rows[0], attempt.views, mask_pictures(attempt, explanation), strict=False
    ):
        axes.imshow(picture)
        axes.set_title(f"semantic mask, {view.name}")
    for axes in rows.flat:
        axes.set_axis_off()
    _draw_heads(rows[1, 0], explanation)
    _draw_alpha(rows[1, 1], explanation)
    _draw_scores(rows[1, 2], attempt, explanation)
    return figure


def mask_pictures(attempt: Attempt, explanation: PolicyExplanation) -> list[np.ndarray]:
    """Paint the semantic mask over every view, from blue (least) to red.

    Args:
        attempt: The attempt, with a percept.
        explanation: What the policy attended to.

    Returns:
        A picture (H, W, 3) uint8 for each view.
    """
    assert attempt.percept is not None
    cloud = attempt.percept.features
    # The network saw some of the points; every other one takes the colour of the nearest.
    nearest = KDTree(explanation.points).query(cloud.points)[1]
    # The mask spans orders of magnitude; the network reads its logarithm too.
    seen = replace(cloud, similarity=np.log1p(explanation.mean_mask)[nearest])
    return [paint_heatmap(view, seen, reach_m=_REACH_M) for view in attempt.views]


def _draw_heads(axes: "Axes", explanation: PolicyExplanation) -> None:
    """Show how concentrated each head's mask is: the share of mass on its top tenth of points."""
    axes.set_axis_on()
    top = max(1, explanation.mask.shape[1] // 10)
    ordered = -np.sort(-explanation.mask, axis=1)
    share = ordered[:, :top].sum(axis=1) / np.maximum(ordered.sum(axis=1), 1e-9)
    axes.bar(np.arange(1, len(share) + 1), share, color="tab:purple")
    axes.set(title="mask on its top 10 % of points", xlabel="head", ylabel="share", ylim=(0, 1))


def _draw_alpha(axes: "Axes", explanation: PolicyExplanation) -> None:
    alpha = explanation.alpha
    axes.set_title("alpha of each layer")
    if not len(alpha):
        axes.text(0.5, 0.5, "no dense-sparse self-attention", ha="center", va="center")
        return
    axes.set_axis_on()
    layers = np.arange(1, len(alpha) + 1)
    axes.bar(layers - 0.2, alpha[:, 0], width=0.4, label="sparse", color="tab:orange")
    axes.bar(layers + 0.2, alpha[:, 1], width=0.4, label="dense", color="tab:blue")
    axes.set(xlabel="layer", ylim=(0, 1), xticks=layers)
    axes.legend(loc="upper right")


def _draw_scores(axes: "Axes", attempt: Attempt, explanation: PolicyExplanation) -> None:
    """Show the candidates from above, coloured by score, and the chosen one."""
    assert attempt.percept is not None and attempt.candidates is not None
    axes.set_axis_on()
    cloud, positions = attempt.percept.geometry, attempt.candidates.positions
    axes.scatter(*cloud.points[:, :2].T, s=0.3, c=cloud.colors, alpha=0.25)
    if len(positions):
        order = np.argsort(explanation.logits)  # the best on top
        dots = axes.scatter(
            *positions[order, :2].T, s=18, c=explanation.logits[order], cmap="turbo"
        )
        axes.figure.colorbar(dots, ax=axes, label="logit")
    if attempt.plan is not None:
        x, y = attempt.plan.T_world_tool[:2, 3]
        axes.plot(x, y, "kx", markersize=12, markeredgewidth=2, label="executed")
        axes.legend(loc="upper right")
    axes.set(title="candidates from above", xlabel="x, m", ylabel="y, m", aspect="equal")
