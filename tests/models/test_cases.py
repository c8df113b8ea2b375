import json
import os
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from models.arrangements.cases import read_cases
from models.errors import ArrangementError
from models.objects.catalogue import BuiltInCatalogue
from models.objects.graspnet import stand_in

CATALOGUE = BuiltInCatalogue()
TEXT = """give me the thera_med
1, 0
assets/simplified_objects/064.urdf 0.5 0.1 0.2 0.1 0.2 0.3
/elsewhere\\objects\\012.urdf 0.45 -0.05 0.2 3.0 -1.5 2.0

012.urdf 0.55 0 0.2 0 0 0
"""


def write(path, text=TEXT):
    path.write_text(text)
    return path


def test_text_file(tmp_path):
    (case,) = read_cases(write(tmp_path / "case 03.txt"), CATALOGUE)
    assert case.name == "case-03"
    assert (case.suite, case.split, case.scene) == ("case", "seen", "cluttered15")
    assert case.goal.text == "give me the thera med"
    first, second = stand_in("064").object_name, stand_in("012").object_name
    assert [item.object for item in case.objects] == [first, second, second]
    assert [item.name for item in case.objects] == [first, second, f"{second}_2"]
    assert case.goal.targets == (second, first)
    assert not case.is_settled
    drop = case.objects[1].drop
    assert drop.position_m == (0.45, -0.05, 0.2)
    # Roll about x first, then pitch about y, then yaw about z, all of them fixed axes.
    x, y, z = (Rotation.from_rotvec(a) for a in ([3.0, 0, 0], [0, -1.5, 0], [0, 0, 2.0]))
    expected = (z * y * x).as_matrix()
    actual = Rotation.from_quat(drop.quat_wxyz, scalar_first=True).as_matrix()
    np.testing.assert_allclose(actual, expected, atol=1e-12)


def test_folder_and_json_list_say_the_same(tmp_path):
    write(tmp_path / "b.txt")
    write(tmp_path / "a.txt", TEXT.replace("1, 0", "2"))
    cases = read_cases(tmp_path, CATALOGUE)
    assert [case.name for case in cases] == ["a", "b"]
    entries = [
        {
            "case": name,
            "goal": "give me the thera_med",
            "target_indices": targets,
            "objects": [
                {"graspnet_id": "064", "drop_xyz_m": [0.5, 0.1, 0.2], "euler_xyz_rad": [0.1, 0.2, 0.3]},
                {"graspnet_id": "012", "drop_xyz_m": [0.45, -0.05, 0.2], "euler_xyz_rad": [3.0, -1.5, 2.0]},
                {"graspnet_id": "012", "drop_xyz_m": [0.55, 0, 0.2], "euler_xyz_rad": [0, 0, 0]},
            ],
        }
        for name, targets in (("a", [2]), ("b", [1, 0]))
    ]  # fmt: skip
    for content in (entries, {"source": "somewhere", "cases": entries}):
        (tmp_path / "cases.json").write_text(json.dumps(content))
        assert read_cases(tmp_path / "cases.json", CATALOGUE) == cases


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("goal\n0\n", "2 lines; expected the goal, the targets' indices, and one line an object."),
        (TEXT.replace("1, 0", "x"), "line 2: 'x' is not a number."),
        (TEXT.replace("1, 0", "0 3"), "target index 3; expected integers from 0 to 2."),
        (TEXT.replace(" 0.3\n", "\n"), "object 0: 6 fields; expected 7: URDF path, x, y, z, roll, pitch, yaw."),
        (TEXT.replace("0.45", "left"), "object 1: 'left' is not a number."),
        (TEXT.replace("0.45", "nan"), "object 1: drop_xyz_m is [nan, -0.05, 0.2]; expected 3 finite numbers."),
        (TEXT.replace("064", "640"), "the built-in catalogue has nothing for GraspNet-1Billion object '640'; import it, or correct the number."),
    ],
)  # fmt: skip
def test_bad_text(tmp_path, text, message):
    path = write(tmp_path / "case.txt", text)
    with pytest.raises(ArrangementError) as error:
        read_cases(path, CATALOGUE)
    assert str(error.value) == f"{path}: {message}"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("[]", "{}: expected a list of cases, or an object with one as 'cases'."),
        ('{"case": 1}', "{}: expected a list of cases, or an object with one as 'cases'."),
        ('[{"goal": "x"}]', "{}: case case00: 'target_indices' is missing; expected goal, target_indices, objects."),
        ('[{"goal": "x", "target_indices": [], "objects": [{"graspnet_id": "012"}]}]', "{}: case case00: object 0: 'drop_xyz_m' is missing; expected graspnet_id, drop_xyz_m, euler_xyz_rad."),
    ],
)  # fmt: skip
def test_bad_json(tmp_path, content, message):
    path = write(tmp_path / "cases.json", content)
    with pytest.raises(ArrangementError) as error:
        read_cases(path, CATALOGUE)
    assert str(error.value) == message.format(path)


def test_paths_without_cases(tmp_path):
    with pytest.raises(ArrangementError) as error:
        read_cases(tmp_path, CATALOGUE)
    assert str(error.value) == f"Folder '{tmp_path}' has no case files (*.txt)."
    with pytest.raises(ArrangementError, match=r"^Cannot read case file '.*/none.txt': "):
        read_cases(tmp_path / "none.txt", CATALOGUE)


@pytest.mark.skipif(
    "SR_MJ_SHARED_DATA" not in os.environ,
    reason="SR_MJ_SHARED_DATA names no folder with pick_cases_seen.json",
)
def test_the_public_cases_can_be_read():
    path = Path(os.environ["SR_MJ_SHARED_DATA"]) / "pick_cases_seen.json"
    cases = read_cases(path, CATALOGUE)
    assert len(cases) == 10
    assert {len(case.objects) for case in cases} == {14, 15}
