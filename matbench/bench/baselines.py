"""Stored ratios of a kind of machine, and when a measured one is a regression."""

import json
from collections.abc import Callable, Mapping, Sequence
from math import sqrt
from pathlib import Path
from statistics import median
from typing import Literal

import cattrs
from attrs import frozen

from matbench.bench import machine
from matbench.bench.load import load
from matbench.bench.measuring import BENCHMARKS, ROUNDS, Progress, Sitting, Timing, Tree, sit
from matbench.errors import UserError

MARGIN = 0.15
"""How far a ratio may lie above the stored one, as a share of it."""

STEADY = 1.15
"""How far apart the ratios with and without load may lie for a slow-down of 1.3 to be seen in both."""

SITTINGS = 3
"""Fresh processes that decide together: the median of so many must lie beyond the margin."""

UPDATES = 3
"""Fresh processes whose median is stored, without load; and so many with it."""

Verdict = Literal["ok", "slower", "faster", "new", "failed"]


@frozen
class Stored:
    """Ratios of a subject: what memory and caches others use slows it more, or less, than the reference.

    Parameters
    ----------
    quiet
        Median of several processes on the machine as it was.
    loaded
        The same while memory was streamed on every core, see `matbench.bench.load`.
    """

    quiet: float
    loaded: float

    @property
    def middle(self) -> float:
        """What is measured is compared with this: nobody knows how much else the machine does meanwhile."""
        return sqrt(self.quiet * self.loaded)

    @property
    def steady(self) -> bool:
        """Whether a slow-down of 1.3 is beyond the limit with and without load."""
        return max(self.quiet, self.loaded) <= STEADY * min(self.quiet, self.loaded)

    def limit(self, margin: float = MARGIN) -> float:
        """What is beyond it is slower: the margin above the middle, and half of it above either ratio."""
        return max(self.middle * (1 + margin), max(self.quiet, self.loaded) * (1 + margin / 2))


@frozen
class Baseline:
    """What is stored for one kind of machine.

    Parameters
    ----------
    machine
        See `machine.kind`.
    reference
        Digest of the reference workload that ratios are in units of.
    ratios
        Subject -> its ratios.
    compilation
        The time of compiling all methods, in units of compiling the reference; None if it was not measured.
    """

    machine: Mapping[str, str]
    reference: str
    ratios: Mapping[str, Stored]
    compilation: float | None = None


@frozen
class Judged:
    """A subject, what was measured of it in one process after the other, and the verdict.

    Parameters
    ----------
    timing
        Of the first sitting; None if it could not be measured.
    ratios
        One of each sitting.
    stored
        None if none is.
    limit
        Beyond which it is slower, as a share of the middle of the stored ratios; NaN without.
    reason
        Why it could not be measured.
    """

    name: str
    verdict: Verdict
    timing: Timing | None
    ratios: tuple[float, ...] = ()
    stored: Stored | None = None
    limit: float = float("nan")
    reason: str = ""

    @property
    def ratio(self) -> float:
        """Median over the sittings."""
        return median(self.ratios) if self.ratios else float("nan")

    @property
    def expected(self) -> float:
        """Middle of the stored ratios; NaN if none are."""
        return self.stored.middle if self.stored else float("nan")

    @property
    def change(self) -> float:
        """Measured over expected, less one; NaN without either."""
        return self.ratio / self.expected - 1


def folder(tree: Tree) -> Path:
    """Where a checkout keeps its baselines."""
    return tree.code / BENCHMARKS / "baselines"


def read(place: Path) -> list[Baseline]:
    """All baselines in a folder.

    Raises
    ------
    UserError
        If a file there is none.
    """
    return [_read(path) for path in sorted(place.glob("*.json"))]


def _read(path: Path) -> Baseline:
    try:
        return cattrs.structure(json.loads(path.read_text(encoding="utf-8")), Baseline)
    except Exception as error:
        raise UserError(f"{path} is no stored baseline: delete it, or write it anew with --update") from error


def replaced(place: Path, baseline: Baseline) -> Baseline | None:
    """What is stored of this kind of machine; None if that cannot be read, or is of another reference."""
    try:
        before = _read(place / machine.file_name(baseline.machine))
    except UserError:
        return None
    return before if before.reference == baseline.reference else None


def write(place: Path, baseline: Baseline) -> Path:
    """Store a baseline in place of what is stored of its kind of machine."""
    path = place / machine.file_name(baseline.machine)
    place.mkdir(parents=True, exist_ok=True)
    content = {**cattrs.unstructure(baseline), "ratios": {n: _short(one) for n, one in sorted(baseline.ratios.items())}}
    path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    return path


def _short(ratios: Stored) -> Mapping[str, float]:
    """Four digits: more were not measured."""
    return {key: float(f"{ratio:.4g}") for key, ratio in cattrs.unstructure(ratios).items()}


def matching(stored: Sequence[Baseline], kind: Mapping[str, str], reference: str) -> tuple[Baseline | None, str]:
    """The baseline of this kind of machine; else None, and in words what the nearest one differs in."""
    for baseline in stored:
        if baseline.machine == kind:
            if baseline.reference == reference:
                return baseline, ""
            return None, "the reference workload is another one than that of the stored baseline"
    if not stored:
        return None, "no baseline is stored"
    nearest = min(stored, key=lambda one: len(machine.differences(one.machine, kind)))
    return (
        None,
        f"no baseline is stored for this kind of machine ({'; '.join(machine.differences(nearest.machine, kind))})",
    )


def judge(
    names: Sequence[str],
    stored: Baseline | None,
    first: Sitting,
    again: Callable[[Sequence[str]], Sitting],
    margin: float = MARGIN,
) -> list[Judged]:
    """Compare a sitting with the stored ratios; what looks slow is measured again in fresh processes.

    One process may be unlucky from beginning to end: where its memory lies, who its neighbours are.
    So a subject whose first ratio is not below its limit by half of the margin sits again until there
    are `SITTINGS`, and it is slower if their median is beyond the limit: if most of them agree.

    Parameters
    ----------
    again
        Measures some subjects in a fresh process.
    """
    ratios = {name: [timing.ratio] for name, timing in first.timings.items()}
    known = {name: stored.ratios[name] for name in names if stored is not None and name in stored.ratios}
    doubtful = {name: old.limit(margin) - old.middle * margin / 2 for name, old in known.items()}
    suspects = [name for name, bound in doubtful.items() if name in ratios and ratios[name][0] > bound]
    failed = dict(first.failed)
    for _ in range(SITTINGS - 1 if suspects else 0):
        sitting = again(suspects)
        failed |= sitting.failed
        for name, timing in sitting.timings.items():
            ratios[name].append(timing.ratio)
    return [
        Judged(name, "failed", None, (), known.get(name), reason=failed.get(name, "not measured"))
        if name in failed or name not in ratios
        else _judged(first.timings[name], name, ratios[name], known.get(name), margin)
        for name in names
    ]


def _judged(timing: Timing, name: str, ratios: Sequence[float], stored: Stored | None, margin: float) -> Judged:
    if stored is None:
        return Judged(name, "new", timing, tuple(ratios))
    found, limit, middle = median(ratios), stored.limit(margin), stored.middle
    verdict: Verdict = "slower" if found > limit else "faster" if found < middle**2 / limit else "ok"
    return Judged(name, verdict, timing, tuple(ratios), stored, limit / middle - 1)


def establish(tree: Tree, names: Sequence[str], rounds: int = ROUNDS, progress: Progress = lambda _: None) -> Baseline:
    """The medians of `UPDATES` fresh processes, and of as many while other work is done on every core.

    Raises
    ------
    UserError
        If a subject cannot be measured.
    """
    sittings: dict[bool, list[Sitting]] = {False: [], True: []}
    for loaded, done in sittings.items():
        with load(loaded):
            for number in range(UPDATES):
                progress(f"process {number + 1} of {UPDATES}{' with other work on every core' if loaded else ''}")
                done.append(sit(tree, names, rounds))
                for name, reason in done[-1].failed.items():
                    raise UserError(f"{name} cannot be measured: {reason}")
    ratios = {
        name: Stored(*(median(one.timings[name].ratio for one in done) for done in sittings.values())) for name in names
    }
    return Baseline(machine.kind(), sittings[False][0].reference, ratios)
