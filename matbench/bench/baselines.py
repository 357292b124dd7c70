"""Stored ratios of a kind of machine, and when a measured one is a regression."""

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import Literal

import cattrs
from attrs import frozen

from matbench.bench import machine
from matbench.bench.measuring import BENCHMARKS, ROUNDS, Progress, Sitting, Timing, Tree, sit
from matbench.errors import UserError

MARGIN = 0.15
"""How far a ratio may lie above the stored one, as a share of it."""

SITTINGS = 3
"""Fresh processes that decide together: the median of so many must lie beyond the margin."""

UPDATES = 5
"""Fresh processes whose median is stored."""

Verdict = Literal["ok", "slower", "faster", "new", "failed"]


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
        Subject -> median of the ratios of several processes.
    compilation
        The same of compiling all methods, in units of compiling the reference; None if it was not measured.
    """

    machine: Mapping[str, str]
    reference: str
    ratios: Mapping[str, float]
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
    reason
        Why it could not be measured.
    """

    name: str
    verdict: Verdict
    timing: Timing | None
    ratios: tuple[float, ...] = ()
    stored: float | None = None
    reason: str = ""

    @property
    def ratio(self) -> float:
        """Median over the sittings."""
        return median(self.ratios) if self.ratios else float("nan")

    @property
    def change(self) -> float:
        """Measured over stored, less one; NaN without either."""
        return self.ratio / self.stored - 1 if self.stored else float("nan")


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
    found = []
    for path in sorted(place.glob("*.json")):
        try:
            found.append(cattrs.structure(json.loads(path.read_text(encoding="utf-8")), Baseline))
        except Exception as error:
            raise UserError(f"{path} is no stored baseline: delete it, or write it anew with --update") from error
    return found


def write(place: Path, baseline: Baseline) -> Path:
    """Store a baseline; what was stored of other subjects on the same kind of machine stays."""
    path = place / machine.file_name(baseline.machine)
    place.mkdir(parents=True, exist_ok=True)
    rounded = {name: float(f"{ratio:.4g}") for name, ratio in sorted(baseline.ratios.items())}
    content = {**cattrs.unstructure(baseline), "ratios": rounded}
    path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    return path


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
    So a subject whose first ratio is beyond half of the margin sits again until there are `SITTINGS`,
    and it is slower if their median is beyond the margin: if most of them agree.

    Parameters
    ----------
    again
        Measures some subjects in a fresh process.
    """
    ratios = {name: [timing.ratio] for name, timing in first.timings.items()}
    known = {name: stored.ratios[name] for name in names if stored is not None and name in stored.ratios}
    suspects = [n for n, ratio in known.items() if n in ratios and ratios[n][0] > ratio * (1 + margin / 2)]
    for _ in range(SITTINGS - 1 if suspects else 0):
        for name, timing in again(suspects).timings.items():
            ratios[name].append(timing.ratio)
    return [_judged(name, first, ratios.get(name, []), known.get(name), margin) for name in names]


def _judged(name: str, first: Sitting, ratios: Sequence[float], stored: float | None, margin: float) -> Judged:
    verdict: Verdict = "new"
    if name in first.failed or not ratios:
        return Judged(name, "failed", None, (), stored, first.failed.get(name, "not measured"))
    if stored is not None:
        change = median(ratios) / stored
        verdict = "slower" if change > 1 + margin else "faster" if change < 1 / (1 + margin) else "ok"
    return Judged(name, verdict, first.timings[name], tuple(ratios), stored)


def establish(tree: Tree, names: Sequence[str], rounds: int = ROUNDS, progress: Progress = lambda _: None) -> Baseline:
    """The medians of `UPDATES` fresh processes.

    Raises
    ------
    UserError
        If a subject cannot be measured.
    """
    sittings = []
    for number in range(UPDATES):
        progress(f"process {number + 1} of {UPDATES}")
        sittings.append(sit(tree, names, rounds))
        for name, reason in sittings[-1].failed.items():
            raise UserError(f"{name} cannot be measured: {reason}")
    ratios = {name: median(one.timings[name].ratio for one in sittings) for name in names}
    return Baseline(machine.kind(), sittings[0].reference, ratios)
