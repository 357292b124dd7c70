"""What a cell ran on: the machine, the libraries, the version of the harness."""

import os
import platform
import shutil
import subprocess
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from matbench._version import __version__

_COMMIT = "MATBENCH_COMMIT"
LIBRARIES = ("numpy", "numba", "opencv-python-headless", "scipy", "rerun-sdk")


@cache
def ran_on() -> Mapping[str, str]:
    """The machine and the versions that this process runs on, as reports show them.

    ``machine`` is a digest: only timings with the same digest are compared. It is taken over the host's
    name (which it does not reveal), the system, the processor, cores, memory and governor.
    """
    hardware = {
        "system": f"{platform.system()} {platform.release()} {platform.machine()}",
        "processor": _processor(),
        "cores": str(os.cpu_count() or 1),
        "memory": _memory(),
        "governor": _governor(),
    }
    # a new kernel does not make another machine: of the system only its kind counts
    alike = "|".join([platform.node(), platform.system(), *list(hardware.values())[1:]])
    return {
        "machine": sha256(alike.encode()).hexdigest()[:8],
        **hardware,
        "python": platform.python_version(),
        **{name: _version(name) for name in LIBRARIES},
        "matbench": __version__,
        "commit": os.environ.get(_COMMIT) or commit(),
    }


@cache
def commit() -> str:
    """The commit of the checkout that the harness runs from; ``none`` if it is installed.

    ``+ changes`` follows if tracked files differ from the commit.
    """
    root = Path(__file__).parents[2]
    git = shutil.which("git")
    if git is None or not (root / ".git").exists():  # git alone would also find a checkout around an installed harness
        return "none"
    try:
        said = [
            subprocess.run([git, "-C", str(root), *what], capture_output=True, text=True, timeout=10, check=True).stdout  # noqa: S603
            for what in (["rev-parse", "HEAD"], ["status", "--porcelain", "--untracked-files=no"])
        ]
    except (OSError, subprocess.SubprocessError):
        return "none"
    return said[0].strip()[:12] + (" + changes" if said[1].strip() else "")


@contextmanager
def commit_known() -> Iterator[None]:
    """Pass the commit to the processes that are started within the block: each would take a while to find it out."""
    os.environ[_COMMIT] = commit()
    try:
        yield
    finally:
        os.environ.pop(_COMMIT, None)


def combined(found: Iterable[Mapping[str, str]]) -> dict[str, str]:
    """The facts of several cells, joined. Where they differ, each value stands once: ``"4; 8"``."""
    values: dict[str, dict[str, None]] = {}
    for facts in found:
        for name, value in facts.items():
            values.setdefault(name, {})[value] = None
    return {name: "; ".join(different) for name, different in values.items()}


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "none"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or "unknown"
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), "unknown")


def _memory() -> str:
    try:
        return f"{os.sysconf('SC_PHYS_PAGES') * os.sysconf('SC_PAGE_SIZE') / 2**30:.0f} GiB"
    except (ValueError, OSError, AttributeError):
        return "unknown"


def _governor() -> str:
    try:
        return Path("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor").read_text().strip()
    except OSError:
        return "unknown"
