"""The training loop."""

import copy
import dataclasses
import json
import time
from typing import Any

import numpy as np
import torch
from torch import nn
from tqdm import tqdm

from policy.demonstrations import DemonstrationFolder
from policy.network.base import CandidateNetwork
from policy.network.checkpoint import save_checkpoint
from policy.network.kinds import make_network
from policy.training.config import TrainConfig
from policy.training.distributed import Ranks
from policy.training.draws import ExampleBatch, ExampleDrawer
from policy.training.feed import feed
from policy.training.logs import RunLog
from policy.training.objective import Objective, Terms, compute_dtype
from policy.training.order import epoch_batches
from policy.training.schedule import rate_factor, rate_groups
from policy.training.signals import StopSignal
from policy.training.split import Split, split_demonstrations
from policy.training.state import Progress, load_state, save_state
from policy.training.statistics import branch_weights, gate_entropy, gradient_norms
from policy.training.store import DecisionStore, memory_free, memory_needed
from policy.training.validation import HeldOut, stop_score

STATE_FILE = "state.safetensors"
BEST_FILE = "best.safetensors"
REFERENCE_FILE = "reference.json"

# What may differ when a run goes on: where and how fast it runs, and when it stops.
_FREE_OPTIONS = ("data", "out", "resume", "threads", "cache", "save_every_s", "tensorboard",
                 "patience", "epochs")  # fmt: skip


class Trainer:
    """One run, from the first step or from where it stopped.

    Attributes:
        config: Options.
        folder: Demonstrations.
        split: Which of them are trained on.
        network: What is trained.
        progress: How far it has come.
    """

    def __init__(self, config: TrainConfig, ranks: Ranks, provenance: dict[str, Any]) -> None:
        """Prepare the run, and read its state if it is to go on.

        Args:
            config: Options.
            ranks: This process among its peers.
            provenance: Command and versions, for the checkpoint's card.

        Raises:
            PolicyError: If data, options or state don't fit.
        """
        self.config, self.ranks, self.provenance = config, ranks, provenance
        self.folder = DemonstrationFolder(config.data)
        self.split: Split = split_demonstrations(
            self.folder.scenes,
            self.folder.objects,
            val_share=config.val_share,
            train_share=config.train_share,
            new_share=config.new_share,
        )
        network_config = config.network_config(self.folder.feature_dim)
        torch.manual_seed(config.seed)
        self.network = make_network(network_config).to(ranks.device)
        self.averaged = copy.deepcopy(self.network).requires_grad_(False)
        store = DecisionStore(self.folder, network_config, in_memory=self._fits_memory())
        self.drawer = ExampleDrawer(store, config)
        self.held_out = HeldOut.of(self.split, self.drawer, batch=config.batch, ranks=ranks)
        self.optimizer = torch.optim.Adam(rate_groups(self.network, config.mixing_rate))
        dtype = compute_dtype(config.precision, config.device)
        weight = config.decoding_weight
        self._objective = Objective(self.network, weight, dtype)
        self._validated = Objective(self._kept_network(), weight, dtype)
        self.progress = Progress()
        state = config.out / STATE_FILE
        if config.resume and state.exists():
            self.progress = load_state(state, self._modules(), self.optimizer, self._identity())
        self._parallel = ranks.wrap(self._objective)
        self._reference: dict[str, Any] = {}

    def run(self, log: RunLog | None, stop: StopSignal) -> bool:
        """Train until the last epoch, early stopping, or a signal.

        Args:
            log: Where to log; None in all processes but the first.
            stop: Set by a signal.

        Returns:
            Whether the run is complete; if not, its state was saved.
        """
        progress, config = self.progress, self.config
        self._reference = self._measure_reference()
        if progress.step == 0 and progress.epoch == 0 and progress.best_score is None:
            self._end_epoch(log, train={})
        while progress.epoch < config.epochs and not self._is_exhausted():
            if not self._run_epoch(log, stop):
                self._save()
                return False
            train = dict(zip(_TRAIN_COLUMNS, _means(progress.sums), strict=True))
            progress.epoch, progress.position, progress.sums = progress.epoch + 1, 0, []
            self._end_epoch(log, train=train)
            self._save()
        return True

    def _run_epoch(self, log: RunLog | None, stop: StopSignal) -> bool:
        progress, config = self.progress, self.config
        batches = epoch_batches(
            self.split.train,
            self.folder.num_candidates,
            batch=config.batch,
            seed=config.seed,
            epoch=progress.epoch,
        )
        num_steps = len(batches) * config.epochs
        self._objective.train()
        last_save = start = time.perf_counter()
        bar = tqdm(
            initial=progress.position,
            total=len(batches),
            desc=f"epoch {progress.epoch + 1}",
            # None: shown on a terminal only.
            disable=None if self.ranks.is_first else True,
            leave=False,
        )
        with bar, gate_entropy(self.network) as entropy:
            waiting = time.perf_counter()
            made = feed(batches[progress.position :], self.drawer, self.ranks, epoch=progress.epoch)
            for num_all, num_own, examples in made:
                data_s = time.perf_counter() - waiting
                row = self._step(examples, num_own, num_all, num_steps)
                now = time.perf_counter()
                if log is not None:
                    row |= {"gate_entropy": entropy.value, "data_s": data_s}
                    row |= {"step_s": now - waiting - data_s}
                    log.add_step({"step": progress.step, "epoch": progress.epoch + 1} | row)
                bar.update()
                bar.set_postfix(loss=f"{row['loss']:.3f}", refresh=False)
                progress.seconds += now - start
                waiting = start = now
                if self.ranks.any(stop.is_set):
                    return False
                if now - last_save > config.save_every_s:
                    self._save()
                    last_save = now
        return True

    def _step(
        self, examples: ExampleBatch, num_own: int, num_all: int, num_steps: int
    ) -> dict[str, float]:
        """Make one step; every process returns the numbers of the whole batch."""
        progress, config, ranks = self.progress, self.config, self.ranks
        rate = config.lr * rate_factor(
            progress.step, schedule=config.schedule, warmup=config.warmup, num_steps=num_steps
        )
        for group in self.optimizer.param_groups:
            group["lr"] = rate * group["factor"]
        terms: Terms = self._parallel(examples)
        self.optimizer.zero_grad()
        # The processes' gradients are averaged; this makes each decision count the same.
        (terms.loss * (num_own * ranks.size / num_all)).backward()
        norms = gradient_norms(self.network)
        total = nn.utils.clip_grad_norm_(
            self.network.parameters(), config.clip if config.clip else float("inf")
        )
        self.optimizer.step()
        self._move_average()
        progress.step += 1
        progress.position += 1
        values = [num_own * float(term.detach()) for term in terms]
        sums = ranks.sum(torch.tensor([num_own, *values], dtype=torch.float64)).tolist()
        progress.sums = [
            a + b for a, b in zip(progress.sums or [0.0] * len(sums), sums, strict=True)
        ]
        row = dict(zip(Terms._fields, _means(sums), strict=True))
        return {"lr": rate} | row | {"grad": float(total)} | norms | branch_weights(self.network)

    def _end_epoch(self, log: RunLog | None, train: dict[str, float]) -> None:
        """Validate, log, and keep the weights if they are the best so far."""
        progress = self.progress
        start = time.perf_counter()
        metrics = self.held_out.measure(self._validated)
        score = stop_score(metrics, self.config.stop_on)
        progress.seconds += time.perf_counter() - start
        progress.bad_epochs += 1
        if progress.best_score is None or score < progress.best_score:
            progress.best_score, progress.best_epoch, progress.bad_epochs = score, progress.epoch, 0
            if self.ranks.is_first:
                self._keep(metrics)
        if log is None:
            return
        row = {"step": progress.step, "epoch": progress.epoch, "seconds": progress.seconds}
        row |= {name: train.get(name, float("nan")) for name in _TRAIN_COLUMNS}
        log.add_epoch(row | metrics | branch_weights(self._kept_network()))
        shown = ("loss", "valid", "top1", "top1_pick", "top1_clear", "top1_place")
        found = {name: metrics[f"val_{name}"] for name in shown if f"val_{name}" in metrics}
        found |= {name: metrics[name] for name in ("new_valid", "new_top1") if name in metrics}
        numbers = "  ".join(f"{name} {value:.3f}" for name, value in found.items())
        mark = "  best" if progress.bad_epochs == 0 else ""
        loss = f"train {train['train_choice']:.3f}  " if train else ""
        tqdm.write(f"epoch {progress.epoch:3d}  {loss}validation: {numbers}{mark}")

    def _keep(self, metrics: dict[str, float]) -> None:
        config, split = self.config, self.split
        scenes = np.array(self.folder.scenes)
        training = self.provenance | {
            "options": json.loads(json.dumps(dataclasses.asdict(config), default=str)),
            "data": {
                "digest": self.folder.digest,
                "decisions": {
                    "train": len(split.train),
                    "val": len(split.val),
                    "new": len(split.new),
                },
                "scenes": {
                    "train": len(set(scenes[split.train])),
                    "val": len(set(scenes[split.val])),
                },
            },
            "epoch": self.progress.epoch,
            "step": self.progress.step,
            "metrics": metrics,
            "reference": self._reference,
        }
        path = config.out / BEST_FILE
        network = self._kept_network()
        save_checkpoint(path, network, training, encoder=self.folder.encoder, half=True)

    def _measure_reference(self) -> dict[str, Any]:
        """Policies without training on the same decisions; measured once a run."""
        path = self.config.out / REFERENCE_FILE
        if not self.ranks.is_first:
            return {}
        if self.config.resume and path.exists():
            return json.loads(path.read_text())
        reference = self.held_out.reference()
        path.write_text(json.dumps(reference, indent=2) + "\n")
        for name, metrics in reference.items():
            numbers = "  ".join(
                f"{key.removeprefix('val_')} {value:.3f}" for key, value in metrics.items()
            )
            tqdm.write(f"{name:>9}  validation: {numbers}")
        return reference

    @torch.no_grad()
    def _move_average(self) -> None:
        if not self.config.averaging:
            return
        # Slower at first than the decay says, or the random weights would linger.
        decay = min(self.config.averaging, (self.progress.step + 1) / (self.progress.step + 10))
        pairs = zip(self.averaged.parameters(), self.network.parameters(), strict=True)
        for average, parameter in pairs:
            average.lerp_(parameter, 1 - decay)

    def _kept_network(self) -> CandidateNetwork:
        return self.averaged if self.config.averaging else self.network

    def _modules(self) -> dict[str, nn.Module]:
        modules: dict[str, nn.Module] = {"network": self.network}
        return modules | ({"averaged": self.averaged} if self.config.averaging else {})

    def _is_exhausted(self) -> bool:
        return 0 < self.config.patience <= self.progress.bad_epochs

    def _fits_memory(self) -> bool:
        if self.config.cache != "auto":
            return self.config.cache == "memory"
        return memory_needed(self.folder) * self.ranks.size < memory_free() / 2

    def _identity(self) -> dict[str, Any]:
        """What must not change when a run goes on."""
        options = json.loads(json.dumps(dataclasses.asdict(self.config), default=str))
        free = _FREE_OPTIONS if self.config.schedule == "constant" else _FREE_OPTIONS[:-1]
        kept = {name: value for name, value in options.items() if name not in free}
        return kept | {"data digest": self.folder.digest, "encoder": self.folder.encoder}

    def _save(self) -> None:
        if self.ranks.is_first:
            path = self.config.out / STATE_FILE
            save_state(path, self._modules(), self.optimizer, self.progress, self._identity())


_TRAIN_COLUMNS = tuple(f"train_{name}" for name in Terms._fields)


def _means(sums: list[float]) -> list[float]:
    """Divide sums by their first entry, the number of decisions."""
    return [value / sums[0] for value in sums[1:]]
