import numpy as np
import pytest

from policy.demonstrations import DemonstrationFolder, write_shard
from policy.errors import InvalidDemonstrationsError, MissingDemonstrationsError


@pytest.fixture
def fill_folder(tmp_path, make_look, make_decision):
    def fill(name="demos", encoder="tower-1", sizes=(2, 1)):
        folder = tmp_path / name
        folder.mkdir(exist_ok=True)
        for number, size in enumerate(sizes):
            look = make_look()
            decisions = [
                (0, make_decision(("pick", "place")[i % 2], 3 + i, clears=size == 1))
                for i in range(size)
            ]
            write_shard(folder / f"s{number}.h5", {"encoder": encoder}, [look], decisions)
        return folder

    return fill


def test_shards_are_one_sequence(fill_folder):
    folder = DemonstrationFolder(fill_folder())
    assert len(folder) == 3
    assert folder.scenes == ("s0", "s0", "s1")
    assert folder.phases == ("pick", "place", "pick")
    assert folder.clears == (False, False, True)
    assert folder.num_candidates == (3, 4, 3)
    assert folder.num_points == (30, 30, 30)
    assert (folder.encoder, folder.feature_dim) == ("tower-1", 16)
    found = [folder[i] for i in range(3)]
    assert [d.scene for d in found] == list(folder.scenes)
    assert [d.decision.phase for d in found] == list(folder.phases)
    assert [len(d.decision.candidates) for d in found] == list(folder.num_candidates)
    np.testing.assert_array_equal(folder[-1].look.points, found[2].look.points)
    assert len(list(folder)) == 3
    for bad in (3, -4):
        with pytest.raises(IndexError, match=f"got {bad}, expected less than 3"):
            folder[bad]


def test_temporary_files_and_markers_are_no_demonstrations(fill_folder):
    path = fill_folder()
    before = DemonstrationFolder(path)
    (path / ".s9.h5.17.tmp").write_text("half")
    (path / ".s9.h5").write_text("half")
    (path / "s8.none.json").write_text("{}")
    after = DemonstrationFolder(path)
    assert (len(after), after.digest, after.verify()) == (3, before.digest, [])


def test_the_digest_depends_on_every_shard(fill_folder):
    path = fill_folder()
    digest = DemonstrationFolder(path).digest
    assert DemonstrationFolder(path).digest == digest
    (path / "s1.h5").rename(path / "s2.h5")
    renamed = DemonstrationFolder(path).digest
    (path / "s2.h5").unlink()
    assert len({digest, renamed, DemonstrationFolder(path).digest}) == 3


def test_damage_is_found_by_verify(fill_folder):
    path = fill_folder()
    folder = DemonstrationFolder(path)
    content = bytearray((path / "s1.h5").read_bytes())
    (path / "s1.h5").write_bytes(content[:-200])
    (problem,) = folder.verify()
    assert str(path / "s1.h5") in problem
    with pytest.raises(InvalidDemonstrationsError, match="can't be read"):
        folder[2]


def test_missing_and_empty_folders_are_refused(tmp_path):
    with pytest.raises(MissingDemonstrationsError) as error:
        DemonstrationFolder(tmp_path / "no")
    assert str(error.value) == (
        f"{tmp_path}/no: got no folder, expected demonstrations. Make them with "
        "python -m sr_mj.collect --out FOLDER."
    )
    with pytest.raises(MissingDemonstrationsError, match="got a folder without demonstrations"):
        DemonstrationFolder(tmp_path)


def test_two_encoders_in_one_folder_are_refused(fill_folder):
    path = fill_folder(sizes=(1, 1, 1))
    fill_folder(encoder="tower-2", sizes=(1,))
    with pytest.raises(InvalidDemonstrationsError) as error:
        DemonstrationFolder(path)
    assert str(error.value) == (
        f"{path}: got demonstrations of 2 encoders, tower-2 with 16 channels (s0), tower-1 with 16 "
        "channels (s2); expected one. Keep each encoder's demonstrations in a folder of its own."
    )
