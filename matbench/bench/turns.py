"""Two trees measured in turns of some milliseconds, in two processes on one core.

Other work on the machine slows both equally, as their turns follow each other closely. So their ratio shows
small changes even on a busy machine, which the ratio to a reference workload cannot.
"""

import json
import os
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from statistics import median
from types import TracebackType
from typing import IO, Self

from attrs import frozen

from matbench.bench.measuring import BENCHMARKS, Tree, environment
from matbench.errors import UserError

SLICE = 0.004  # seconds that a turn takes at least: long for the clock, short enough that a disturbance hits both trees
ENOUGH, FEWEST = 0.4, 7  # a subject that takes long gets turns for 0.4 s in all, but never fewer than 7


@frozen
class Turns:
    """What one pair of processes measured of a subject.

    Parameters
    ----------
    ratio
        Median over the turns of time of the working tree / time of the base; NaN if not measured.
    reason
        Why there is no ratio.
    """

    ratio: float = float("nan")
    reason: str = ""


def in_turns(
    here: Tree, base: Tree, names: Sequence[str], rounds: int, number: int = 0, tests: Path | None = None
) -> Mapping[str, Turns]:
    """Measure subjects in a fresh pair of processes, one subject after the other.

    Parameters
    ----------
    rounds
        Turns of each subject; fewer for those that take long.
    number
        Number of the pair. It decides on which core the pair runs and which tree begins.
    tests
        The checkout whose tests/benchmarks are used; `here` by default.

    Raises
    ------
    UserError
        If a process measures other code than its tree's.
    """
    cores = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else [0]
    # both on one core: cores differ in speed and temperature, and what disturbs one core then disturbs both trees
    core = cores[number % len(cores)]
    with ExitStack() as stack:

        def side(name: str, tree: Tree) -> _Side:
            said = stack.enter_context(tempfile.TemporaryFile("w+", errors="replace"))
            return stack.enter_context(_Side(name, tree, tests or here.code, core, said))

        one, other = side("working tree", here), side("base", base)
        one.begin()
        other.begin()
        return {name: _turns(one, other, name, rounds, number) for name in names}


def _turns(here: "_Side", base: "_Side", name: str, rounds: int, number: int) -> Turns:
    try:
        # zero calls: the first one compiles and warms up, and tells how long a call takes
        call = max(here.seconds(name, 0), base.seconds(name, 0), 1e-6)
        calls = max(1, round(SLICE / call))
        enough = max(FEWEST, round(ENOUGH / (calls * call)))
        ratios = []
        for turn in range(min(rounds, enough)):
            # who begins alternates: the first of a turn finds the caches as the other left them
            first, second = (here, base) if (turn + number) % 2 == 0 else (base, here)
            taken = {side: side.seconds(name, calls) for side in (first, second)}
            ratios.append(taken[here] / taken[base])
    except _NotMeasured as error:
        return Turns(reason=str(error))
    return Turns(median(ratios))


class _NotMeasured(Exception):
    """A subject could not be measured in one of the trees; the message says which, and why."""


class _Side:
    """A process that runs subjects of one tree, as many calls as it is asked for."""

    def __init__(self, name: str, tree: Tree, tests: Path, core: int, said: IO[str]):
        self._name, self._tree, self._said = name, tree, said
        program = f"import sys; sys.path.append({str(tests / BENCHMARKS)!r}); import in_turns; in_turns.main()"
        self._process = subprocess.Popen(  # noqa: S603 (this interpreter, no shell)
            [str(tree.python), "-c", program, str(core)],
            cwd=tree.code,
            env=environment(tree),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=said,
            text=True,
            bufsize=1,
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: type[BaseException] | BaseException | TracebackType | None) -> None:
        self._process.kill()  # it holds nothing worth keeping, and may be in the middle of a long call
        self._process.communicate()

    def begin(self) -> None:
        """Wait until the process is ready, and check that it has the right code."""
        try:
            code = self._answer()["code"]
        except _NotMeasured as error:
            raise UserError(f"nothing was measured: {error}") from None
        if Path(str(code)) != self._tree.code.resolve():
            raise UserError(f"{code} was measured instead of {self._tree.code}: is another matbench before it?")

    def seconds(self, name: str, calls: int) -> float:
        """Processor seconds of so many calls. With 0 calls: make the subject ready, and the seconds of one call."""
        try:
            print(json.dumps([name, calls]), file=self._process.stdin, flush=True)
        except OSError:
            raise self._gone() from None
        answer = self._answer()
        if "failed" in answer:
            raise _NotMeasured(f"not in the {self._name}: {answer['failed']}")
        return float(str(answer["seconds"]))

    def _answer(self) -> Mapping[str, object]:
        line = self._process.stdout.readline() if self._process.stdout else ""
        if not line:
            raise self._gone()
        found: Mapping[str, object] = json.loads(line)
        return found

    def _gone(self) -> _NotMeasured:
        self._process.wait()
        self._said.seek(0)
        said = [line.strip() for line in self._said if line.strip()]
        return _NotMeasured(f"the {self._name} ended: {said[-1] if said else f'status {self._process.returncode}'}")
