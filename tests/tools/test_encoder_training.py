"""Training of the embedded encoder, on one rendered shard: exact parts, resuming, exporting."""

import shutil
from pathlib import Path

import numpy as np
import pytest
import torch

from perception.encoders.embedded import WEIGHT_FILES, WEIGHTS_DIR, EmbeddedEncoder
from perception.encoders.embedded import EmbeddedEncoderConfig as EncoderConfig
from tools.encoder.export import export_trained
from tools.encoder.lattice import LastStages
from tools.encoder.losses import distillation_loss
from tools.encoder.maps import MIXED_ID, extract_maps, load_maps, main_ids, split_cells
from tools.encoder.pictures import FIRST_OBJECT_ID, OTHER_ID, TABLE_ID
from tools.encoder.shards import load_shard, render_shard
from tools.encoder.training import TrainedPart, TrainingConfig, train, untrained_encoder
from tools.encoder.training_set import TrainingSet, draw_batch, gather

pytestmark = pytest.mark.render

CONFIG = TrainingConfig(steps=3, num_pictures=2, save_every=2)


@pytest.fixture(scope="module")
def encoder() -> EmbeddedEncoder:
    return untrained_encoder()


@pytest.fixture(scope="module")
def shard(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return render_shard(tmp_path_factory.mktemp("data"), "val", 0)


@pytest.fixture(scope="module")
def data(shard: Path, encoder: EmbeddedEncoder) -> TrainingSet:
    target = shard.parent / "maps" / shard.stem
    extract_maps(EmbeddedEncoder(), shard, target)
    return gather([target], encoder)


@pytest.fixture(scope="module")
def run(data: TrainingSet, encoder: EmbeddedEncoder, shard: Path) -> Path:
    return train(data, encoder, CONFIG, shard.parent / "run").parent


def test_lattices_together_are_the_tower(shard: Path, encoder: EmbeddedEncoder) -> None:
    cells = encoder.encode_cells([load_shard(shard).rgb(0)])
    final, parts, _ = split_cells(cells)
    stages = LastStages(encoder.trunk).requires_grad_(False)
    rebuilt = torch.empty_like(final)
    for row, column in np.ndindex(2, 2):
        rebuilt[:, row::2, column::2] = stages.finish(stages(parts, (row, column)))
    torch.testing.assert_close(rebuilt, final, atol=1e-4, rtol=0)


def test_cells_say_what_they_show() -> None:
    ids = np.full((8, 12), TABLE_ID, np.uint8)
    ids[:4, :2] = FIRST_OBJECT_ID + 3  # half of the first cell
    ids[4:, 4:5] = FIRST_OBJECT_ID + 1  # a quarter of another one
    ids[:, 8:] = OTHER_ID
    expected = [[FIRST_OBJECT_ID + 3, TABLE_ID, OTHER_ID], [TABLE_ID, MIXED_ID, OTHER_ID]]
    assert main_ids(ids).tolist() == expected


def test_batch_belongs_together(data: TrainingSet) -> None:
    batch = draw_batch(data, 3, np.random.default_rng(1))
    row, column = batch.phase
    lattice = batch.parts[:, row::2, column::2].reshape(-1, batch.parts.shape[-1])
    assert torch.equal(lattice[batch.cells], batch.part_cells)
    assert len(batch.owners) + len(batch.places) == len(batch.cells)
    assert np.array_equal(np.unique(batch.owners), np.arange(len(batch.objects)))
    assert set(batch.places) <= {TABLE_ID, OTHER_ID}


def test_unchanged_classes_have_no_distance() -> None:
    logits = torch.randn(5, 7, generator=torch.Generator().manual_seed(0))
    assert distillation_loss(logits, logits, 2.0).item() == pytest.approx(0, abs=1e-6)
    assert distillation_loss(logits, logits.roll(1, dims=1), 2.0).item() > 0.01


def test_training_resumes_where_it_stopped(
    data: TrainingSet, encoder: EmbeddedEncoder, run: Path, tmp_path: Path
) -> None:
    straight = torch.load(run / "trained.pt", weights_only=True)
    # The checkpoint of step 2 is what an interruption after it leaves behind.
    shutil.copy(run / "checkpoint.pt", tmp_path)
    resumed = torch.load(train(data, encoder, CONFIG, tmp_path), weights_only=True)
    assert straight.keys() == resumed.keys()
    for name, tensor in straight.items():
        torch.testing.assert_close(resumed[name], tensor, atol=1e-6, rtol=1e-5)


def test_training_moves_what_it_should(encoder: EmbeddedEncoder, run: Path) -> None:
    before = TrainedPart(encoder, CONFIG).state_dict()
    after = torch.load(run / "trained.pt", weights_only=True)
    changed = {name for name in before if not torch.equal(before[name], after[name])}
    assert {"stages.head", "stages.reduce.4", "head.hidden.weight"} <= changed
    assert not any(n.startswith(("stages.depth", "head.mixture")) for n in changed)


def test_exported_weights_are_what_was_trained(
    encoder: EmbeddedEncoder, shard: Path, run: Path, tmp_path: Path
) -> None:
    trained = torch.load(run / "trained.pt", weights_only=True)
    for name in set(WEIGHT_FILES) - {"head.safetensors"}:
        (tmp_path / name).symlink_to(WEIGHTS_DIR / name)
    export_trained(trained, tmp_path)
    model = TrainedPart(encoder, CONFIG).eval()
    model.load_state_dict(trained)
    exported = EmbeddedEncoder(EncoderConfig(precision="float32"), tmp_path)
    cells = exported.encode_cells([load_shard(shard).rgb(0)])[0]
    final, parts, rest = split_cells(cells)
    with torch.no_grad():
        maps = model.stages(parts[None], (0, 0))
        # Up to 6; in half precision on disk.
        torch.testing.assert_close(model.stages.finish(maps)[0], final[::2, ::2], atol=0.06, rtol=0)
        rows = torch.cat([final, parts, rest], dim=-1).reshape(-1, cells.shape[-1])
        # Training clips outliers.
        usual = ((rows - model.mean) / model.deviation).abs().amax(dim=1) < 8
        rows = rows[usual]
        projected = model.project(rows, 0.0)
    assert usual.float().mean() > 0.5
    # Training projects in bfloat16.
    expected = torch.nn.functional.normalize(projected, dim=-1)
    found = torch.nn.functional.normalize(exported.head.project(rows), dim=-1)
    assert (expected * found).sum(dim=1).min() > 0.999


def test_maps_are_kept(data: TrainingSet, shard: Path, encoder: EmbeddedEncoder) -> None:
    target = shard.parent / "maps" / shard.stem
    before = (target / "parts.npy").stat().st_mtime_ns
    extract_maps(encoder, shard, target)
    assert (target / "parts.npy").stat().st_mtime_ns == before
    maps = load_maps(target)
    assert maps.parts.shape[:3] == maps.rest.shape[:3] == maps.ids.shape
