import json
import subprocess
import sys

import h5py
import numpy as np
import pytest

from policy.demonstrations import SCHEMA_VERSION, read_shard, write_shard
from policy.demonstrations.shard import find_problems, read_demonstration
from policy.errors import InvalidArrayError, InvalidDemonstrationsError

META = {"encoder": "tower-1", "seed": 7, "objects": ["pear"]}


@pytest.fixture
def shard_path(tmp_path, make_look, make_decision):
    path = tmp_path / "scene.h5"
    looks = [make_look(), make_look(num_points=12)]
    decisions = [
        (0, make_decision()),
        (1, make_decision("place", num_candidates=3, num_points=12)),
        (0, make_decision(clears=True)),
    ]
    write_shard(path, META, looks, decisions)
    return path, looks, decisions


def test_what_is_written_is_read_again(shard_path):
    path, looks, decisions = shard_path
    shard = read_shard(path)
    assert (shard.scene, shard.encoder, shard.feature_dim, shard.meta) == (
        "scene",
        "tower-1",
        16,
        META,
    )
    assert [entry["look"] for entry in shard.index] == [0, 1, 0]
    assert [entry["num_points"] for entry in shard.index] == [30, 12, 30]
    for number, (look, decision) in enumerate(decisions):
        found = read_demonstration(shard, number)
        np.testing.assert_array_equal(found.look.points, looks[look].points)
        np.testing.assert_array_equal(found.look.confidence, looks[look].confidence)
        np.testing.assert_array_equal(found.look.workspace_max, looks[look].workspace_max)
        np.testing.assert_array_equal(
            found.look.features, looks[look].features.astype(np.float16).astype(np.float32)
        )
        for name in ("phase", "relation", "side", "executed", "seed", "clears", "objects"):
            assert getattr(found.decision, name) == getattr(decision, name)
        for name in ("valid", "avoid_collision", "expert_logits"):
            np.testing.assert_array_equal(getattr(found.decision, name), getattr(decision, name))
        for name in ("Ts_world_tool", "width_m", "prior"):
            np.testing.assert_array_equal(
                getattr(found.decision.candidates, name), getattr(decision.candidates, name)
            )
        for said, wording in zip(found.decision.wordings, decision.wordings, strict=True):
            assert said.text == wording.text
            for name in ("tokens", "pooled", "similarity"):
                np.testing.assert_allclose(
                    getattr(said, name), getattr(wording, name), rtol=1e-3, atol=1e-6
                )
            assert (said.phrase_pooled is None) == (wording.phrase_pooled is None)


def test_the_same_content_has_the_same_digest_and_other_content_another(
    tmp_path, make_look, make_decision
):
    look, decision = make_look(), make_decision()
    for name, meta in (("a", META), ("b", META), ("c", META | {"seed": 8})):
        write_shard(tmp_path / f"{name}.h5", meta, [look], [(0, decision)])
    digests = [read_shard(tmp_path / f"{name}.h5").digest for name in "abc"]
    assert digests[0] == digests[1] != digests[2]


@pytest.mark.parametrize(
    "name",
    [
        "looks/1/features",
        "decisions/0/valid",
        "decisions/1/wordings/1/similarity",
        "decisions/2/poses",
    ],
)
def test_any_changed_value_is_found(shard_path, name):
    path, _, _ = shard_path
    assert find_problems(path) == []
    with h5py.File(path, "r+") as file:
        values = file[name][()]
        values.flat[0] = not values.flat[0]
        file[name][...] = values
    assert find_problems(path) == [f"{path}: the content has changed since it was written."]


def test_cut_and_foreign_files_are_refused_in_one_line(shard_path, tmp_path):
    path, _, _ = shard_path
    content = path.read_bytes()
    (tmp_path / "cut.h5").write_bytes(content[: len(content) // 2])
    (tmp_path / "text.h5").write_text("no")
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["x"] = 1
    for name in ("cut", "text", "other"):
        (problem,) = find_problems(tmp_path / f"{name}.h5")
        assert problem.startswith(f"{tmp_path / name}.h5: got a file that can't be read (")
        assert problem.endswith(
            "), expected a shard of demonstrations. Delete it, and collect again what is missing."
        )
        assert "\n" not in problem


def test_another_schema_is_refused(shard_path):
    path, _, _ = shard_path
    with h5py.File(path, "r+") as file:
        file.attrs["schema_version"] = SCHEMA_VERSION + 1
    with pytest.raises(InvalidDemonstrationsError) as error:
        read_shard(path)
    assert str(error.value) == (
        f"{path}: got schema {SCHEMA_VERSION + 1}, expected {SCHEMA_VERSION}. Collect the "
        "demonstrations again with this version, or use the version that wrote them."
    )


def test_a_failed_write_leaves_nothing(tmp_path, make_look, make_decision):
    path = tmp_path / "scene.h5"
    with pytest.raises(TypeError):
        write_shard(path, META | {"odd": object()}, [make_look()], [(0, make_decision())])
    with pytest.raises(InvalidArrayError, match="got 0 decisions and encoder 'tower-1'"):
        write_shard(path, META, [make_look()], [])
    with pytest.raises(InvalidArrayError, match="got 1 decisions and encoder None"):
        write_shard(path, {}, [make_look()], [(0, make_decision())])
    with pytest.raises(InvalidDemonstrationsError):
        write_shard(path, META, [make_look(num_points=4)], [(0, make_decision())])
    assert list(tmp_path.iterdir()) == []


_WRITER = """
import itertools, os, signal, sys, time
import numpy as np
from pathlib import Path
from policy.actions import ActionCandidates
from policy.demonstrations import Decision, Look, Wording, write_shard

rng = np.random.default_rng(0)
look = Look(points=rng.uniform(size=(400, 3)), features=np.eye(400, 64), confidence=np.ones(400),
            workspace_min=np.zeros(3), workspace_max=np.ones(3))
said = Wording(text="x", tokens=np.ones((4, 64)), pooled=np.ones(64), phrase_pooled=None,
               similarity=np.ones(400))
candidates = ActionCandidates(kind="pick", Ts_world_tool=np.eye(4)[None], width_m=np.ones(1),
                              prior=np.ones(1))
decision = Decision(phase="pick", relation=None, side=None, wordings=(said,), candidates=candidates,
                    executed=0, valid=np.ones(1, bool), avoid_collision=np.zeros(1),
                    expert_logits=np.zeros(1), seed=0)
for delay in (0.0, 0.003, 0.007, 0.012):
    child = os.fork()
    if not child:
        for number in itertools.count():
            path = Path(sys.argv[1]) / f"{delay}-{number:05d}.h5"
            write_shard(path, {"encoder": "e"}, [look], [(0, decision)])
    while not list(Path(sys.argv[1]).glob(f"{delay}-*.h5")):
        time.sleep(0.001)
    time.sleep(delay)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
"""


def test_a_writer_killed_at_any_moment_leaves_only_whole_files(tmp_path):
    subprocess.run([sys.executable, "-c", _WRITER, str(tmp_path)], check=True)
    shards = sorted(tmp_path.glob("[!.]*.h5"))
    assert shards
    assert [problem for path in shards for problem in find_problems(path)] == []


def test_meta_stays_json(shard_path):
    path, _, _ = shard_path
    assert json.loads(json.dumps(read_shard(path).meta)) == META
