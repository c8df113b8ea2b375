import numpy as np
import pytest

from policy.training.order import epoch_batches, sorted_batches

SIZES = np.random.default_rng(3).integers(1, 300, 500)
INDICES = np.arange(10, 497)


def _padding(batches: list[np.ndarray]) -> int:
    return sum(int(SIZES[b].max() * len(b) - SIZES[b].sum()) for b in batches)


@pytest.mark.parametrize("batch", [1, 7, 32, 1000])
def test_every_index_once(batch: int) -> None:
    for batches in (
        epoch_batches(INDICES, SIZES, batch=batch, seed=0, epoch=0),
        sorted_batches(INDICES, SIZES, batch=batch),
    ):
        np.testing.assert_array_equal(np.sort(np.concatenate(batches)), INDICES)
        assert max(map(len, batches)) <= batch
        assert sum(len(b) < batch for b in batches) <= 1


def test_order_depends_on_seed_and_epoch_only() -> None:
    def order(seed: int, epoch: int) -> list[int]:
        batches = epoch_batches(INDICES, SIZES, batch=8, seed=seed, epoch=epoch)
        return np.concatenate(batches).tolist()

    assert order(0, 0) == order(0, 0)
    assert len({tuple(order(*key)) for key in ((0, 0), (0, 1), (1, 0), (1, 1))}) == 4


def test_sorting_saves_padding() -> None:
    rng = np.random.default_rng(0)
    shuffled = np.array_split(rng.permutation(INDICES), range(16, len(INDICES), 16))
    bucketed = epoch_batches(INDICES, SIZES, batch=16, seed=0, epoch=0)
    best = sorted_batches(INDICES, SIZES, batch=16)
    assert _padding(best) < _padding(bucketed) < 0.5 * _padding(shuffled)
