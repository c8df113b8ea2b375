"""How well do policies choose where the encoder confuses what is meant with something else?

    python -m tools.bench.confusion --data demos
    python -m tools.bench.confusion --data demos --new-share 0.2 --policies \
        sr@runs/new-0/best.safetensors a2@runs/new-a2-0/best.safetensors grounding

Every held-out decision is asked for twice: with the similarity of the points as it is, and with
the larger one of it and that of another decision about the same look, which means other objects, as
if the encoder took both for what is meant. What is right stays right. Features and texts stay as
they are, so that they tell the two apart. Decisions without such a partner are left out. Prints the
share of right choices by kind of decision.
"""

from collections import defaultdict
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from tqdm import tqdm

from perception.encoders import load_encoder
from policy.base import Policy
from policy.demonstrations import DemonstrationFolder
from policy.demonstrations.decision import Demonstration
from policy.errors import InvalidConfigError
from policy.observation import Observation
from policy.registry import load_policy
from policy.training.split import split_demonstrations
from sr_mj.cli import run_command
from tools.table_text import markdown

KINDS = ("pick", "clear", "inside", "outside")
"""To pick a target, to clear the way to it, to place in or on a reference, to place around it."""


@dataclass(frozen=True, kw_only=True)
class ConfusionConfig:
    """Options of `python -m tools.bench.confusion`."""

    data: Path
    """Folder of demonstrations."""
    policies: tuple[str, ...] = ("sr", "sr-a", "base", "a2", "vlg", "grounding", "random")
    """Names of policies that need no pictures, or NAME@CHECKPOINT."""
    val_share: float = 0.1
    """Share of scenes that were held out in training."""
    new_share: float = 0.0
    """Share of objects that were; if not 0, decisions are those that mean one of them."""
    limit: int = 0
    """Most decisions, drawn from all; 0 for all."""
    threads: int = 1
    """Threads of torch."""

    def __post_init__(self) -> None:
        """Check what would otherwise end in an empty table."""
        if not self.policies:
            raise InvalidConfigError("policies: got none, expected at least one name.")
        if self.limit < 0:
            raise InvalidConfigError(f"limit: got {self.limit}, expected 0 for all, or more.")


def confuse(observation: Observation, other: Observation) -> Observation:
    """Let what another instruction means fit this one as well.

    Args:
        observation: What was seen and said.
        other: The same points with another instruction.

    Returns:
        The observation with the larger one of both similarities at every point.
    """
    return replace(observation, similarity=np.maximum(observation.similarity, other.similarity))


def partners(folder: DemonstrationFolder) -> dict[int, int]:
    """Find for decisions the next one about the same look that means none of their objects.

    Args:
        folder: Demonstrations.

    Returns:
        Index of the partner by index of the decision; those without are missing.
    """
    looks = [(shard.scene, entry["look"]) for shard in folder.shards for entry in shard.index]
    together = defaultdict(list)
    for index, look in enumerate(looks):
        together[look].append(index)
    found = {}
    for index, look in enumerate(looks):
        own = set(folder.objects[index])
        others = [i for i in together[look] if not own & set(folder.objects[i])]
        if others:
            found[index] = min(others, key=lambda i: (i < index, abs(i - index)))
    return found


def kind_of(demonstration: Demonstration) -> str:
    """Return which of `KINDS` a demonstration is."""
    decision = demonstration.decision
    return decision.side or ("clear" if decision.clears else "pick")


def stand_ins(fingerprint: str) -> tuple[str, ...]:
    """Return the fingerprints of the same encoder in every arithmetic, if it is the embedded one.

    Args:
        fingerprint: Encoder of the demonstrations.

    Returns:
        What the weights of a policy may have been trained with.
    """
    embedded = load_encoder("embedded").fingerprints
    return embedded if fingerprint in embedded else (fingerprint,)


def measure(
    folder: DemonstrationFolder, indices: np.ndarray, policies: dict[str, Policy]
) -> dict[tuple[str, str], list[tuple[bool, bool]]]:
    """Ask policies with and without a confused similarity.

    Args:
        folder: Demonstrations.
        indices: Those to ask about.
        policies: By name.

    Returns:
        For every policy and kind, whether the choice is right as it was seen, and confused.
    """
    found, rng = defaultdict(list), np.random.default_rng(0)
    partner = partners(folder)
    for index in tqdm([int(i) for i in indices if int(i) in partner], unit="decisions"):
        demonstration = folder[index]
        decision, plain = demonstration.decision, demonstration.observation()
        confused = confuse(plain, folder[partner[index]].observation())
        for name, policy in policies.items():
            plainly, otherwise = (
                bool(decision.valid[policy.score(seen, decision.candidates, rng).best])
                for seen in (plain, confused)
            )
            found[name, kind_of(demonstration)].append((plainly, otherwise))
    return found


def main(config: ConfusionConfig) -> int:
    """Measure and print a table in markdown."""
    import torch

    torch.set_num_threads(config.threads)
    folder = DemonstrationFolder(config.data)
    split = split_demonstrations(
        folder.scenes, folder.objects, val_share=config.val_share, new_share=config.new_share
    )
    indices = split.new if config.new_share else split.val
    if 0 < config.limit < len(indices):
        indices = np.sort(np.random.default_rng(0).permutation(indices)[: config.limit])
    policies, encoder = {}, stand_ins(folder.encoder)
    for text in config.policies:
        name, _, checkpoint = text.partition("@")
        policies[text] = load_policy(name, checkpoint=checkpoint or None, encoder=encoder)
    found = measure(folder, indices, policies)
    if not found:
        raise InvalidConfigError(
            f"data: got {len(indices)} held-out decisions in {config.data}, none with another one "
            "about the same look; collect more scenes, or change --val-share or --new-share."
        )
    kinds = [kind for kind in KINDS if (config.policies[0], kind) in found]
    counts = {kind: len(found[config.policies[0], kind]) for kind in kinds}
    rows = []
    for name in config.policies:
        shares = [np.array(found[name, kind]).mean(axis=0) * 100 for kind in kinds]
        rows.append([f"`{name}`", *(f"{plain:.0f} -> {other:.0f} %" for plain, other in shares)])
    print(markdown(["policy", *(f"{kind}, {counts[kind]}" for kind in kinds)], rows))
    return 0


if __name__ == "__main__":
    run_command(ConfusionConfig, main, __doc__ or "")
