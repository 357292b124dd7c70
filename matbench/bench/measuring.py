"""A sitting: the subjects of tests/benchmarks, timed by pytest-benchmark in one fresh process."""

import importlib.util
import json
import os
import runpy
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np
from attrs import frozen

from matbench.errors import UserError, unknown
from matbench.files.documents import read_json
from matbench.files.temporary import temporary_folder
from matbench.measures.statistics import median_interval
from matbench.plans import kernels
from matbench.plans.plugins import kernel_cache

BENCHMARKS = Path("tests", "benchmarks")
# a subject's rounds come in three parts, spread over the sitting: a disturbance then spoils one part and not all
ROUNDS, PARTS = 25, 3
# bytes: malloc keeps freed blocks up to this size instead of giving them back to the system. Else every round
# would get fresh pages, and the time would be mostly that of the system clearing them.
_LARGEST = str(2**30)
_MOST = 1 << 28  # bytes of what a sitting measured
_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


@frozen
class Timing:
    """What a sitting measured of one subject.

    Parameters
    ----------
    ratio, low, high
        Time of a call of the subject / time of a call of the reference workload, both in the same round: the
        median over the rounds, and its 95 % interval within this sitting.
    seconds
        Median processor time of one call.
    reference
        The same of one call of the reference.
    group
        ``method`` or ``kernel``.
    """

    ratio: float
    low: float
    high: float
    seconds: float
    reference: float
    group: str
    rounds: int


@frozen
class Sitting:
    """What one process measured.

    Parameters
    ----------
    failed
        Subject -> why it could not be measured.
    digest
        Digest of the reference workload and of the subjects.
    """

    timings: Mapping[str, Timing]
    failed: Mapping[str, str]
    digest: str


@frozen
class Tree:
    """A checkout of matbench that is measured.

    Parameters
    ----------
    code
        The folder that holds its ``matbench/``.
    python
        The interpreter whose libraries it runs with.
    kernels
        The folder of its compiled kernels: one for each state of the code.
    """

    code: Path
    python: Path
    kernels: Path

    @classmethod
    def here(cls) -> "Tree":
        """The checkout that this module lies in.

        Raises
        ------
        UserError
            If matbench is not run from a checkout, or pytest-benchmark is not installed.
        """
        code = Path(__file__).resolve().parents[2]
        if not (code / BENCHMARKS / "test_speed.py").is_file():
            raise UserError(
                f"{code} holds no {BENCHMARKS}: timings are judged in a checkout, installed by "
                "pip install -e '.[test]'; --scaling works anywhere"
            )
        if importlib.util.find_spec("pytest_benchmark") is None:
            raise UserError("pytest-benchmark is not installed: pip install -e '.[test]'")
        return cls(code, Path(sys.executable), kernel_cache())


def environment(tree: Tree) -> dict[str, str]:
    """The environment of a process that measures: one thread, the tree's own kernels, memory kept by malloc.

    Variables for pytest are left out. They are meant for an outer pytest; under pytest-xdist they would
    make pytest-benchmark time nothing.
    """
    kept = {"MALLOC_MMAP_THRESHOLD_": _LARGEST, "MALLOC_TRIM_THRESHOLD_": _LARGEST, "PYTHONHASHSEED": "0"}
    threads = dict.fromkeys(_ONE_THREAD, "1")
    inherited = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")}
    return {**inherited, **threads, **kept, kernels.VARIABLE: str(tree.kernels)}


def _pytest(tree: Tree, *arguments: str) -> subprocess.CompletedProcess[str]:
    benchmarks = tree.code / BENCHMARKS
    command = [str(tree.python), "-m", "pytest", "-c", str(tree.code / "pyproject.toml"), "-p", "no:cacheprovider"]
    return subprocess.run(  # noqa: S603 (this interpreter, no shell)
        [*command, "-q", f"--confcutdir={benchmarks}", str(benchmarks / "test_speed.py"), *arguments],
        cwd=tree.code,  # `python -m` imports from there first: the tree's own code, whatever else is installed
        env=environment(tree),
        capture_output=True,
        text=True,
        check=False,
    )


def subjects(tree: Tree, patterns: Sequence[str] = ()) -> list[str]:
    """The subjects of a checkout that names or patterns mean; all of them if none are given.

    Raises
    ------
    UserError
        If a pattern means no subject.
    """
    listed = runpy.run_path(str(tree.code / BENCHMARKS / "subjects.py"))
    names = [*listed["METHODS"], *listed["KERNELS"]]
    chosen: dict[str, None] = {}
    for pattern in patterns:
        meant = [name for name in names if pattern == name or fnmatchcase(name, pattern)]
        if not meant:
            raise unknown("subject", pattern, names)
        chosen |= dict.fromkeys(meant)
    return list(chosen) or names


def sit(tree: Tree, names: Sequence[str], rounds: int = ROUNDS) -> Sitting:
    """Time subjects in a fresh process, in rounds with the reference workload.

    Raises
    ------
    UserError
        If the process measured nothing, or measured other code than the tree's.
    """
    with temporary_folder() as place:
        written = place / "benchmarks.json"
        done = _pytest(
            tree,
            f"--benchmark-min-rounds={-(-rounds // PARTS)}",
            f"--parts={PARTS}",
            f"--benchmark-json={written}",
            *(f"--subject={name}" for name in names),
        )
        try:
            found: dict[str, Any] = read_json(written, most=_MOST)
            measured = found["measured"]
        except (OSError, ValueError, KeyError):
            raise UserError(f"nothing was measured in {tree.code}: {_last_line(done)}") from None
    # an installed matbench that comes first in the path would be measured under a false name
    if Path(measured["code"]) != tree.code.resolve():
        raise UserError(f"{measured['code']} was measured instead of {tree.code}: is another matbench before it?")
    parts: dict[str, list[Any]] = {}
    for one in found["benchmarks"]:
        if one["extra_info"].get("ratios"):
            parts.setdefault(one["params"]["name"], []).append(one)
    timings = {name: _timing(of_name) for name, of_name in parts.items()}
    missing = {name: "not measured" for name in names if name not in timings}
    return Sitting(timings, {**missing, **measured["failed"]}, measured["digest"])


def _timing(parts: Sequence[Any]) -> Timing:
    """The timing of a subject from all its rounds."""
    ratios = np.concatenate([part["extra_info"]["ratios"] for part in parts])
    seconds, reference = (
        float(np.median([part["extra_info"][of] for part in parts])) for of in ("seconds", "reference_seconds")
    )
    return Timing(*median_interval(ratios), seconds, reference, parts[0]["group"], ratios.size)


def run_program(tree: Tree, name: str) -> Any:
    """Run a program of tests/benchmarks in a fresh process; what it prints, as JSON.

    Raises
    ------
    UserError
        If it fails.
    """
    tests = str(tree.code / BENCHMARKS)
    program = f"import runpy, sys; sys.path.append({tests!r}); runpy.run_module({name!r}, run_name='__main__')"
    done = subprocess.run(  # noqa: S603 (this interpreter, no shell)
        [str(tree.python), "-c", program],
        cwd=tree.code,
        env=environment(tree),
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise UserError(f"{tests}/{name}.py failed: {_last_line(done)}")
    return json.loads(done.stdout.splitlines()[-1])  # the last line: libraries may print before it


def _last_line(done: subprocess.CompletedProcess[str]) -> str:
    lines = [line for line in (done.stdout + done.stderr).splitlines() if line.strip()]
    return lines[-1].strip() if lines else f"exit status {done.returncode}"


Progress = Callable[[str], None]
"""Called with what begins, in words."""
