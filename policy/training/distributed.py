"""One training in several processes, started by torchrun."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import torch
import torch.distributed as dist
from torch import Tensor, nn
from torch.nn.parallel import DistributedDataParallel

from policy.errors import InvalidConfigError


@dataclass(frozen=True, kw_only=True)
class Ranks:
    """This process among its peers.

    Attributes:
        rank: Number of this process.
        size: Number of processes.
        device: Device of this process.
    """

    rank: int
    size: int
    device: str

    @property
    def is_first(self) -> bool:
        """Whether this process writes the files."""
        return self.rank == 0

    def wrap(self, module: nn.Module) -> nn.Module:
        """Make a module whose gradients are averaged over the processes.

        Args:
            module: The module, equal everywhere.

        Returns:
            The module itself if there is one process only.
        """
        if self.size == 1:
            return module
        devices = [torch.device(self.device)] if self.device != "cpu" else None
        # Some settings of the network leave parameters without a gradient.
        return DistributedDataParallel(module, device_ids=devices, find_unused_parameters=True)

    def sum(self, values: Tensor) -> Tensor:
        """Add up a tensor over the processes."""
        if self.size > 1:
            values = values.clone().to(self.device)
            dist.all_reduce(values)
        return values

    def any(self, flag: bool) -> bool:
        """Tell whether a flag is set in any process."""
        return flag if self.size == 1 else bool(self.sum(torch.tensor([float(flag)])).item())


@contextmanager
def joined(device: str) -> Iterator[Ranks]:
    """Join the other processes, if torchrun started any.

    Args:
        device: cpu (gloo) or cuda (nccl, one device a process).

    Yields:
        This process's place.

    Raises:
        InvalidConfigError: If there is no such device.
    """
    if device == "cuda" and not torch.cuda.is_available():
        raise InvalidConfigError("device: got cuda, which torch does not find here; expected cpu.")
    size = int(os.environ.get("WORLD_SIZE", "1"))
    rank, local = (int(os.environ.get(name, "0")) for name in ("RANK", "LOCAL_RANK"))
    if device == "cuda":
        torch.cuda.set_device(local)
        device = f"cuda:{local}"
    if size == 1:
        yield Ranks(rank=0, size=1, device=device)
        return
    store, rank, size = next(dist.rendezvous("env://"))
    backend = "gloo" if device == "cpu" else "nccl"
    dist.init_process_group(backend, store=store, rank=rank, world_size=size)
    try:
        yield Ranks(rank=rank, size=size, device=device)
        # gloo fails where a peer hangs up before the last exchange was read: leave together.
        store.set(f"done/{rank}", "")
        store.wait([f"done/{peer}" for peer in range(size)])
    finally:
        dist.destroy_process_group()
