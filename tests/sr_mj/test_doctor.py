import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from sr_mj import doctor, gl
from sr_mj.doctor import Finding

ROOT = Path(__file__).parents[2]
FINE = Finding(section="a", name="fine", value="1.0", is_needed=True)
ODD = Finding(section="a", name="odd", value="none", is_ok=False, mend="get odd")
MISSING = Finding(
    section="b", name="gone", value="missing", is_ok=False, is_needed=True, mend="get gone"
)


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(
        [sys.executable, *arguments], env=environment, capture_output=True, text=True
    )


@pytest.mark.render
def test_the_report_of_this_machine_is_json_and_agrees_with_the_exit_status():
    done = run("-m", "sr_mj.doctor", "--json")
    report = json.loads(done.stdout)
    assert done.returncode == (0 if report["healthy"] else 1)
    by_section: dict[str, dict[str, dict]] = {}
    for finding in report["findings"]:
        by_section.setdefault(finding["section"], {})[finding["name"]] = finding
    assert set(by_section) == {"versions", "machine", "system libraries", "graphics", "encoders"}
    assert by_section["versions"]["python"]["value"].startswith("3.")
    assert by_section["versions"]["mujoco"]["is_ok"]
    assert int(by_section["machine"]["cores"]["value"]) >= 1
    assert any(finding["is_ok"] for finding in by_section["graphics"].values())
    assert by_section["encoders"]["embedded"]["is_needed"]


def test_help_and_wrong_arguments_load_nothing_heavy():
    program = (
        "import sys\n"
        "from sr_mj import doctor\n"
        "try: doctor.main([sys.argv[1]])\n"
        "except SystemExit as stop: print(stop.code, end=' ')\n"
        "heavy = {'numpy', 'torch', 'mujoco', 'open3d', 'perception', 'dm_control'}\n"
        "print(sorted(heavy & set(sys.modules)))\n"
    )
    done = run("-c", program, "--help")
    assert "Print JSON instead of a table." in done.stdout
    assert done.stdout.splitlines()[-1] == "0 []"
    assert run("-c", program, "--jsn").stdout.splitlines()[-1] == "2 []"


def test_the_packages_are_those_of_the_project_file():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    wanted = {
        match.group()
        for text in (*project["dependencies"], *project["optional-dependencies"]["sim"])
        if (match := re.match(r"[A-Za-z0-9-]+", text))
    }
    assert set(doctor._PACKAGES) == wanted


def test_a_missing_package_is_named_with_the_command_that_installs_it(monkeypatch):
    monkeypatch.setattr(doctor, "_PACKAGES", ("sr-mj-no-such-package",))
    assert list(doctor.find_versions())[-1] == Finding(
        section="versions",
        name="sr-mj-no-such-package",
        value="missing",
        is_ok=False,
        is_needed=True,
        mend="pip install sr-mj-no-such-package",
    )


def test_a_missing_system_library_is_named_with_the_command_that_installs_it(monkeypatch):
    monkeypatch.setattr(doctor, "_SYSTEM_LIBRARIES", {"libSrMjNone.so.1": "libsrmjnone1"})
    assert list(doctor.find_system_libraries()) == [
        Finding(
            section="system libraries",
            name="libSrMjNone.so.1",
            value="missing",
            is_ok=False,
            is_needed=True,
            mend="apt-get install libsrmjnone1",
        )
    ]


@pytest.mark.render
def test_where_nothing_renders_every_attempt_is_listed_and_the_last_one_tells_what_to_do(
    monkeypatch,
):
    for name in ("MUJOCO_GL", "DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/dev/null")
    monkeypatch.setenv("GALLIUM_DRIVER", "none")
    findings = list(doctor.find_graphics())
    assert [finding.name for finding in findings] == ["egl", "osmesa", "glfw"]
    assert not any(finding.is_ok for finding in findings)
    assert [finding.mend for finding in findings] == ["", "", gl.MEND]
    assert not doctor.is_healthy(findings)


def test_rendering_turned_off_is_a_finding(monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "off")
    (finding,) = doctor.find_graphics()
    assert (finding.name, finding.value, finding.is_ok) == ("MUJOCO_GL", "off", False)
    assert finding.mend.startswith("MUJOCO_GL='off' turns rendering off.")


@pytest.mark.parametrize(
    ("findings", "is_healthy"), [((), True), ((FINE, ODD), True), ((FINE, ODD, MISSING), False)]
)
def test_only_what_is_needed_counts(findings, is_healthy):
    assert doctor.is_healthy(findings) is is_healthy


def test_the_table_marks_what_is_missing_and_ends_with_what_to_do():
    assert doctor.as_text((FINE, ODD, MISSING)) == (
        "a\n"
        "  ok  fine  1.0\n"
        "  --  odd   none\n"
        "\n"
        "b\n"
        "  !!  gone  missing\n"
        "\n"
        "Something is missing.\n"
        "  get odd\n"
        "  get gone"
    )


def test_the_json_holds_the_same():
    report = json.loads(doctor.as_json((FINE, MISSING)))
    assert report["healthy"] is False
    assert Finding(**report["findings"][0]) == FINE
    assert Finding(**report["findings"][1]) == MISSING
