"""The working tree against another commit, measured alternately on the same machine."""

import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
import venv
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

import numpy as np
from attrs import frozen

from matbench.bench.measuring import ROUNDS, Progress, Sitting, Tree, sit
from matbench.errors import UserError
from matbench.statistics import CONFIDENCE

PAIRS = 4
"""Pairs of processes, A B, B A, A B, ...: each pair gives one ratio of every subject."""


@frozen
class Versus:
    """A subject in both trees.

    Parameters
    ----------
    ratio, low, high
        Time of the working tree / time of the base: geometric mean over the pairs of processes, and its
        interval by Student's t on the logarithms; NaN where one of them has no such subject.
    reason
        Why there is no ratio.
    """

    name: str
    group: str
    ratio: float = float("nan")
    low: float = float("nan")
    high: float = float("nan")
    reason: str = ""

    def verdict(self, margin: float) -> Literal["slower", "faster", "same", "unsure", "not compared"]:
        """``slower`` or ``faster`` only if the whole interval says so and the ratio is beyond the margin."""
        if self.reason:
            return "not compared"
        if self.low > 1 and self.ratio > 1 + margin:
            return "slower"
        if self.high < 1 and self.ratio < 1 / (1 + margin):
            return "faster"
        return "same" if 1 / (1 + margin) < self.low and self.high < 1 + margin else "unsure"


def _git(code: Path, *arguments: str) -> str:
    program = shutil.which("git")
    if program is None:
        raise UserError("git is not installed: --base needs it")
    done = subprocess.run([program, "-C", str(code), *arguments], capture_output=True, text=True, check=False)  # noqa: S603
    if done.returncode:
        raise UserError(f"git {arguments[0]}: {(done.stderr.strip().splitlines() or ['failed'])[-1]}")
    return done.stdout.strip()


def commit(code: Path, name: str) -> str:
    """The full digest of a commit.

    Raises
    ------
    UserError
        If there is none of that name, or no repository.
    """
    _git(code, "rev-parse", "--git-dir")
    try:
        return _git(code, "rev-parse", "--verify", "--quiet", "--end-of-options", f"{name}^{{commit}}")
    except UserError:
        raise UserError(
            f"base {name!r} is no commit of {code}: name a branch, a tag or a digest, such as HEAD~1, "
            "and git fetch first what is not here"
        ) from None


def _needs(code: Path) -> tuple[Any, ...]:
    """What a checkout declares to depend on."""
    project = tomllib.loads((code / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return (
        project.get("requires-python"),
        project.get("dependencies"),
        project.get("optional-dependencies", {}).get("test"),
    )


@contextmanager
def base_tree(here: Tree, digest: str, progress: Progress) -> Iterator[Tree]:
    """Another commit in a git worktree, with an environment of its own; both go when it ends.

    Where it declares the same dependencies as the working tree, its environment shares the libraries
    that are installed here: the same versions, and no network is needed. Else they are installed.
    """
    with tempfile.TemporaryDirectory(prefix="matbench-base-") as place:
        code = Path(place, "code")
        _git(here.code, "worktree", "add", "--detach", "--quiet", str(code), digest)
        try:
            environment = Path(place, "venv")
            if _needs(code) == _needs(here.code):
                progress(f"base {digest[:8]}: the libraries that are installed here")
                venv.create(environment, symlinks=True)
                python = _python(environment)
                _share_libraries(python, code, here)
            else:
                progress(f"base {digest[:8]}: installing its own libraries")
                venv.create(environment, symlinks=True, with_pip=True)
                python = _python(environment)
                _run(python, "-m", "pip", "install", "--quiet", "--editable", f"{code}[test]")
            yield Tree(code, python, Path(place, "kernels"))
        finally:
            _git(here.code, "worktree", "remove", "--force", str(code))


def _python(environment: Path) -> Path:
    return environment / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def _share_libraries(python: Path, code: Path, here: Tree) -> None:
    """Its own code first, then every folder of libraries of this process, the working tree's code never."""
    packages = _run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))")
    standard = {str(Path(os.__file__).parent), str(Path(os.__file__).parent / "lib-dynload")}
    shared = [
        entry
        for entry in dict.fromkeys(sys.path)
        if Path(entry).is_dir() and Path(entry).resolve() != here.code and entry not in standard
    ]
    Path(packages, "base.pth").write_text("\n".join([str(code), *shared]) + "\n", encoding="utf-8")


def _run(python: Path, *arguments: str) -> str:
    done = subprocess.run([str(python), *arguments], capture_output=True, text=True, check=False)  # noqa: S603
    if done.returncode:
        said = [line for line in done.stderr.splitlines() if line.strip()]
        raise UserError(f"the base's environment could not be made: {said[-1].strip() if said else 'no reason given'}")
    return done.stdout.strip()


def compare(
    here: Tree, base: Tree, names: Sequence[str], pairs: int = PAIRS, rounds: int = ROUNDS, progress: Progress = print
) -> list[Versus]:
    """Both trees timed by the working tree's benchmarks, in processes that alternate."""
    sittings: dict[bool, list[Sitting]] = {True: [], False: []}
    for number in range(pairs):
        for is_here in (number % 2 == 0, number % 2 == 1):
            progress(f"pair {number + 1} of {pairs}: {'working tree' if is_here else 'base'}")
            sittings[is_here].append(sit(here if is_here else base, names, rounds, here.code))
    return [versus(name, sittings[True], sittings[False]) for name in names]


def versus(name: str, here: Sequence[Sitting], base: Sequence[Sitting]) -> Versus:
    """What pairs of sittings say of a subject."""
    group = next((one.timings[name].group for one in (*here, *base) if name in one.timings), "")
    for where, sittings in (("working tree", here), ("base", base)):
        missing: Mapping[str, str] = next((one.failed for one in sittings if name not in one.timings), {})
        if missing:
            return Versus(name, group, reason=f"not in the {where}: {missing.get(name, 'not measured')}")
    logs = np.log([a.timings[name].ratio / b.timings[name].ratio for a, b in zip(here, base, strict=True)])
    ratio = float(np.exp(logs.mean()))
    if logs.size < 2:
        return Versus(name, group, ratio)
    from scipy.stats import t

    reach = float(t.ppf((1 + CONFIDENCE) / 2, logs.size - 1) * logs.std(ddof=1) / np.sqrt(logs.size))
    return Versus(name, group, ratio, ratio * float(np.exp(-reach)), ratio * float(np.exp(reach)))
