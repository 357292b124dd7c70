"""The working tree against another commit, the base: both measured in turns on the same machine."""

import os
import shutil
import subprocess
import sys
import venv
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any, Literal

import numpy as np
from attrs import frozen

from matbench.bench.measuring import ROUNDS, Progress, Tree
from matbench.bench.turns import Turns, in_turns
from matbench.errors import UserError, one_line
from matbench.files.locking import Busy, held
from matbench.files.temporary import temporary_folder
from matbench.files.toml import read_toml
from matbench.measures.statistics import CONFIDENCE
from matbench.plans.plugins import kernel_cache

PAIRS = 4
"""Pairs of processes; each gives one ratio of every subject.

Where a process's memory lies changes its speed by some per cent, for as long as it lives: so several are needed.
"""


@frozen
class Versus:
    """How fast a subject is in the working tree, compared with the base.

    Parameters
    ----------
    ratio, low, high
        Time of the working tree / time of the base: geometric mean over the pairs of processes, and its
        confidence interval by Student's t on the logarithms; NaN where one of them lacks the subject.
    reason
        Why there is no ratio.
    """

    name: str
    ratio: float = float("nan")
    low: float = float("nan")
    high: float = float("nan")
    reason: str = ""

    def verdict(self, margin: float) -> Literal["slower", "faster", "same", "unsure", "not compared"]:
        """``slower`` or ``faster`` if the whole interval lies on that side of 1 and the ratio is beyond the margin."""
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


def last_change(code: Path, file: Path) -> str | None:
    """The commit that last changed a file of a checkout; None if that is not known.

    It is unknown where there is no repository, only its newest part (a shallow clone), or a repository
    that holds the checkout as one of its folders; and where the file has uncommitted changes.
    """
    try:
        if not file.is_file() or Path(_git(code, "rev-parse", "--show-toplevel")).resolve() != code.resolve():
            return None
        if _git(code, "rev-parse", "--is-shallow-repository") != "false":
            return None
        if _git(code, "status", "--porcelain", "--", str(file.resolve())):
            return None
        return _git(code, "rev-list", "-1", "HEAD", "--", str(file.resolve())) or None
    except UserError:
        return None


def _needs(code: Path) -> tuple[Any, ...]:
    """The dependencies that a checkout declares: of Python, of the package, of its tests."""
    project = read_toml(code / "pyproject.toml", "project file").get("project", {})
    return (
        project.get("requires-python"),
        project.get("dependencies"),
        project.get("optional-dependencies", {}).get("test"),
    )


@contextmanager
def base_tree(here: Tree, digest: str, progress: Progress) -> Iterator[Tree]:
    """Another commit in a git worktree, with a virtual environment; both are removed when the block ends.

    Where it declares the same dependencies as the working tree, its environment uses the libraries
    that are installed here: the same versions, and no network is needed. Else they are installed.
    Its compiled kernels stay for the next time.

    Raises
    ------
    UserError
        If git or pip fails.
    """
    # the same folder for the same commit every time: numba finds compiled kernels by the path of their source
    kept = kernel_cache().parent / digest
    try:
        with ExitStack() as stack:
            place = stack.enter_context(temporary_folder())
            code = stack.enter_context(_folder_alone(kept, place / "code"))
            # git still lists a worktree whose folder a killed run has lost, and refuses to add it again
            _git(here.code, "worktree", "prune")
            _git(here.code, "worktree", "add", "--detach", "--quiet", str(code), digest)
            # numba reuses a compiled kernel only if its source has the same path, time and size;
            # a new checkout has new times, so all get the same one
            for file in code.rglob("*.py"):
                os.utime(file, (0, 0))
            environment = place / "venv"
            if _needs(code) == _needs(here.code):
                progress(f"base {digest[:8]}: the libraries that are installed here")
                venv.create(environment, symlinks=True)  # without pip: nothing is installed
                python = _python(environment)
                _share_libraries(python, code, here)
            else:
                progress(f"base {digest[:8]}: installing its own libraries")
                try:
                    venv.create(environment, symlinks=True, with_pip=True)
                except subprocess.CalledProcessError as error:
                    raise UserError(f"the base's environment could not be made: {one_line(error)}") from error
                python = _python(environment)
                _run(python, "-m", "pip", "install", "--quiet", "--editable", f"{code}[test]")
            yield Tree(code, python, kept / "kernels")
    finally:
        with suppress(UserError):
            _git(here.code, "worktree", "prune")


@contextmanager
def _folder_alone(kept: Path, else_this: Path) -> Iterator[Path]:
    """A new folder ``kept/code``, removed when the block ends; `else_this` if another process is using that.

    What a killed process has left in the folder is removed first: the system has released its lock.
    """
    kept.mkdir(parents=True, exist_ok=True)
    with ExitStack() as stack:
        try:
            is_ours = bool(stack.enter_context(held(kept)))
        except Busy:
            is_ours = False
        if not is_ours:  # another process has it, or nothing can be locked there
            yield else_this
            return
        wanted = kept / "code"
        try:
            shutil.rmtree(wanted, ignore_errors=True)
            yield wanted
        finally:
            shutil.rmtree(wanted, ignore_errors=True)


def _python(environment: Path) -> Path:
    return environment / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def _share_libraries(python: Path, code: Path, here: Tree) -> None:
    """Let the base's interpreter find its own code first, then all libraries of this process.

    The working tree's own code is left out: else the base would be measured with it.
    """
    packages = _run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))")
    # the base's interpreter has a standard library of its own
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
    here: Tree,
    base: Tree,
    names: Sequence[str],
    margin: float,
    pairs: int = PAIRS,
    rounds: int = ROUNDS,
    progress: Progress = print,
) -> list[Versus]:
    """Measure both trees in turns, by the working tree's benchmarks, in several pairs of processes.

    Subjects that are unsure after `pairs` pairs are measured in as many again.
    """
    taken: dict[str, list[Turns]] = {name: [] for name in names}
    found: dict[str, Versus] = {}
    unsure = list(names)
    for number in range(2 * pairs):
        if number == pairs:  # the second half is for what is still unsure: most verdicts need no more time
            unsure = [name for name, one in found.items() if one.verdict(margin) == "unsure"]
        if unsure:
            progress(f"pair {number + 1} of {pairs if number < pairs else 2 * pairs}: working tree and base in turns")
            for name, turns in in_turns(here, base, unsure, rounds, number).items():
                taken[name].append(turns)
        found = {name: versus(name, pairs_of_it) for name, pairs_of_it in taken.items()}
    return list(found.values())


def versus(name: str, pairs: Sequence[Turns]) -> Versus:
    """Sum up what several pairs of processes measured of a subject."""
    for one in pairs:
        if one.reason:
            return Versus(name, reason=one.reason)
    # ratios multiply, so their logarithms are averaged: half and twice as fast cancel out
    logs = np.log([one.ratio for one in pairs])
    ratio = float(np.exp(logs.mean()))
    if logs.size < 2:
        return Versus(name, ratio)
    from scipy.stats import t

    reach = float(t.ppf((1 + CONFIDENCE) / 2, logs.size - 1) * logs.std(ddof=1) / np.sqrt(logs.size))
    return Versus(name, ratio, ratio * float(np.exp(-reach)), ratio * float(np.exp(reach)))
