"""Say whether this machine has what the project needs, and what to run where it does not.

Usage: `python -m sr_mj.doctor [--json]`. Exits with 0 if everything needed is there, else with 1.
"""

import ctypes
import dataclasses
import importlib.metadata
import json
import os
import platform
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated

import tyro

_MIN_PYTHON = (3, 11)
_PACKAGES = (
    "mujoco",
    "dm-control",
    "mink",
    "daqp",
    "open3d",
    "torch",
    "torchvision",
    "open-clip-torch",
    "timm",
    "transformers",
    "tokenizers",
    "huggingface-hub",
    "safetensors",
    "numpy",
    "scipy",
    "h5py",
    "shapely",
    "trimesh",
    "manifold3d",
    "jsonschema",
    "lxml",
    "pillow",
    "imageio",
    "matplotlib",
    "tqdm",
    "tyro",
    "jaxtyping",
)
# What Open3D's library links against (readelf -d libOpen3D.so), and the packages that have it.
_SYSTEM_LIBRARIES = {
    "libEGL.so.1": "libegl1",
    "libGL.so.1": "libgl1",
    "libX11.so.6": "libx11-6",
    "libudev.so.1": "libudev1",
    "libusb-1.0.so.0": "libusb-1.0-0",
    "libidn2.so.0": "libidn2-0",
}
_NEEDED_ENCODER = "embedded"
_USEFUL_CPU_FLAGS = ("avx2", "avx512f", "avx512_bf16", "amx_bf16")


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One line of the report.

    Attributes:
        section: The heading it belongs under.
        name: What was looked for.
        value: What was found.
        is_ok: Whether that is good enough.
        is_needed: Whether the project cannot do without it.
        mend: What to run or to do if it is not good enough; empty if it is.
    """

    section: str
    name: str
    value: str
    is_ok: bool = True
    is_needed: bool = False
    mend: str = ""


def find_versions() -> Iterator[Finding]:
    """Look for Python, for this project and for the packages that it needs."""
    version = platform.python_version()
    is_ok = sys.version_info >= _MIN_PYTHON
    wanted = ".".join(map(str, _MIN_PYTHON))
    yield Finding(
        section="versions",
        name="python",
        value=version,
        is_ok=is_ok,
        is_needed=True,
        mend="" if is_ok else f"Use Python {wanted} or later.",
    )
    yield Finding(
        section="versions", name="sr-mj", value=_installed("sr-mj") or "used from its source"
    )
    for package in _PACKAGES:
        installed = _installed(package)
        yield Finding(
            section="versions",
            name=package,
            value=installed or "missing",
            is_ok=installed is not None,
            is_needed=True,
            mend="" if installed else f"pip install {package}",
        )


def find_machine() -> Iterator[Finding]:
    """Describe the processor and the memory."""
    cores = str(len(os.sched_getaffinity(0)))
    ram_gib = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 2**30
    flags = _cpu_flags()
    useful = [flag for flag in _USEFUL_CPU_FLAGS if flag in flags]
    yield Finding(section="machine", name="cores", value=cores)
    yield Finding(section="machine", name="memory", value=f"{ram_gib:.1f} GiB")
    yield Finding(section="machine", name="cpu flags", value=" ".join(useful) or "none of interest")


def find_system_libraries() -> Iterator[Finding]:
    """Look for the shared libraries that Open3D links against."""
    for soname, package in _SYSTEM_LIBRARIES.items():
        try:
            ctypes.CDLL(soname)
            is_ok = True
        except OSError:
            is_ok = False
        yield Finding(
            section="system libraries",
            name=soname,
            value="found" if is_ok else "missing",
            is_ok=is_ok,
            is_needed=True,
            mend="" if is_ok else f"apt-get install {package}",
        )


def find_graphics() -> Iterator[Finding]:
    """Render a frame with each backend that may be used, up to the first that works."""
    from sr_mj.errors import RenderError
    from sr_mj.gl import BACKENDS, MEND, prove_backend, select_backend

    backends: Sequence[str] = BACKENDS
    if os.environ.get("MUJOCO_GL", "").strip():
        try:
            backends = (select_backend(),)
        except RenderError as error:
            yield Finding(
                section="graphics",
                name="MUJOCO_GL",
                value=os.environ["MUJOCO_GL"],
                is_ok=False,
                is_needed=True,
                mend=str(error),
            )
            return
    for backend in backends:
        proof = prove_backend(backend)
        # One working backend is enough: only the last one's failure leaves nothing to render with.
        is_last = backend == backends[-1]
        yield Finding(
            section="graphics",
            name=backend,
            value=f"renders with {proof.renderer}" if proof.works else proof.failure,
            is_ok=proof.works,
            is_needed=proof.works or is_last,
            mend=MEND if is_last and not proof.works else "",
        )
        if proof.works:
            return


def find_encoders() -> Iterator[Finding]:
    """Look for the weights of the vision-language encoders; only the embedded one is needed."""
    from perception.encoders import encoder_weights_status

    for status in encoder_weights_status():
        is_ok = status.path is not None
        yield Finding(
            section="encoders",
            name=status.name,
            value=str(status.path)
            if is_ok
            else f"no weights; to have them: {status.fetch_command}",
            is_ok=is_ok,
            is_needed=status.name == _NEEDED_ENCODER,
            mend="" if is_ok or status.name != _NEEDED_ENCODER else status.fetch_command,
        )


def examine() -> tuple[Finding, ...]:
    """Look at everything; takes a few seconds."""
    findings: list[Finding] = []
    for find in (
        find_versions,
        find_machine,
        find_system_libraries,
        find_graphics,
        find_encoders,
    ):
        try:
            findings.extend(find())
        except (ImportError, OSError) as error:
            section = find.__name__.removeprefix("find_").replace("_", " ")
            findings.append(
                Finding(
                    section=section,
                    name="import",
                    value=" ".join(str(error).split()),
                    is_ok=False,
                    is_needed=True,
                    mend="Mend what is missing above, then run this again.",
                )
            )
    return tuple(findings)


def is_healthy(findings: Sequence[Finding]) -> bool:
    """Tell whether everything that is needed is there."""
    return all(finding.is_ok or not finding.is_needed for finding in findings)


def as_text(findings: Sequence[Finding]) -> str:
    """Format findings as a table under headings, and the mends after it."""
    width = max(len(finding.name) for finding in findings)
    lines: list[str] = []
    section = ""
    for finding in findings:
        if finding.section != section:
            section = finding.section
            lines += ["", section]
        mark = "ok" if finding.is_ok else "!!" if finding.is_needed else "--"
        lines.append(f"  {mark}  {finding.name:<{width}}  {finding.value}")
    mends = list(dict.fromkeys(finding.mend for finding in findings if finding.mend))
    verdict = "Everything needed is there." if is_healthy(findings) else "Something is missing."
    return "\n".join([*lines[1:], "", verdict, *(f"  {mend}" for mend in mends)])


def as_json(findings: Sequence[Finding]) -> str:
    """Format findings as JSON: `{"healthy": bool, "findings": [...]}`."""
    rows = [dataclasses.asdict(finding) for finding in findings]
    return json.dumps({"healthy": is_healthy(findings), "findings": rows}, indent=2)


@dataclass(frozen=True, kw_only=True)
class DoctorArgs:
    """Say whether this machine has what the project needs, and what to run where it does not."""

    json: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Print JSON instead of a table."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        argv: Arguments; those of the process if None.

    Returns:
        The exit status: 0 if everything needed is there, else 1.
    """
    args = tyro.cli(DoctorArgs, prog="python -m sr_mj.doctor", args=argv)
    findings = examine()
    print(as_json(findings) if args.json else as_text(findings))
    return 0 if is_healthy(findings) else 1


def _installed(package: str) -> str | None:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return None


def _cpu_flags() -> frozenset[str]:
    try:
        with open("/proc/cpuinfo") as file:
            for line in file:
                if line.startswith("flags"):
                    return frozenset(line.partition(":")[2].split())
    except OSError:  # not Linux
        pass
    return frozenset()


if __name__ == "__main__":
    sys.exit(main())
