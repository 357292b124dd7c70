"""Stored ratios of a kind of machine, and when a measured one is a regression."""

import json
from collections.abc import Callable, Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from statistics import median
from typing import Literal

import cattrs
from attrs import evolve, frozen

from matbench.bench import machine
from matbench.bench.base import Versus
from matbench.bench.measuring import BENCHMARKS, ROUNDS, Progress, Sitting, Timing, Tree, sit
from matbench.errors import UserError

MARGIN = 0.15
"""How much more time than the stored code a subject may take, as a share of it."""

SUSPECT = 0.1
"""How far a ratio must lie above the stored one, as a share of it, for a closer look; less with a margin below it."""

SITTINGS = 3
"""Fresh processes that decide together where the commit that stored a ratio is not at hand: their median does."""

UPDATES = 5
"""Fresh processes when ratios are stored: that counts in which the reference was quickest."""

Verdict = Literal["ok", "slower", "faster", "unsure", "new", "failed"]


@frozen
class Baseline:
    """What is stored for one kind of machine.

    Parameters
    ----------
    machine
        See `machine.kind`.
    digest
        Of the reference workload that ratios are in units of, and of the subjects.
    code
        Digest of the methods' code whose ratios they are, see `code_digest`.
    ratios
        Subject -> its ratio, of the process that others disturbed least.
    compilation
        The time of compiling all methods, in units of compiling the reference; None if it was not measured.
    """

    machine: Mapping[str, str]
    digest: str
    code: str
    ratios: Mapping[str, float]
    compilation: float | None = None


@frozen
class Judged:
    """A subject, what was measured of it, and the verdict.

    Parameters
    ----------
    timing
        Of the first sitting; None if it could not be measured.
    ratios
        One of each sitting.
    stored
        The ratio that is; NaN if none is.
    against
        The working tree against the code that the ratio was stored of; None where that was not asked.
    reason
        Why it could not be measured.
    """

    name: str
    verdict: Verdict
    timing: Timing | None
    ratios: tuple[float, ...] = ()
    stored: float = float("nan")
    against: Versus | None = None
    reason: str = ""

    @property
    def ratio(self) -> float:
        """Median over the sittings."""
        return median(self.ratios) if self.ratios else float("nan")

    @property
    def change(self) -> float:
        """How much slower than the stored code, as a share: as measured in turns, else by the ratios."""
        return self.against.ratio - 1 if self.against else self.ratio / self.stored - 1


def folder(tree: Tree) -> Path:
    """Where a checkout keeps its baselines."""
    return tree.code / BENCHMARKS / "baselines"


def code_digest(code: Path) -> str:
    """SHA-256 of the methods of a checkout."""
    digest = sha256()
    for file in sorted((code / "algorithms").rglob("*.py")):
        digest.update(f"{file.relative_to(code).as_posix()}\0".encode() + file.read_bytes())
    return digest.hexdigest()


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
    return before if before.digest == baseline.digest else None


def store_baseline(place: Path, baseline: Baseline) -> Path:
    """Store a baseline in place of what is stored of its kind of machine."""
    path = place / machine.file_name(baseline.machine)
    place.mkdir(parents=True, exist_ok=True)
    digits = {name: float(f"{ratio:.4g}") for name, ratio in sorted(baseline.ratios.items())}  # more were not measured
    content = {**cattrs.unstructure(baseline), "ratios": digits}
    path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    return path


def matching(place: Path, kind: Mapping[str, str], digest: str) -> tuple[Baseline | None, str]:
    """The baseline of this kind of machine; else None, and in words what the nearest one differs in.

    Raises
    ------
    UserError
        If a file there is no baseline.
    """
    stored = {path.name: _read(path) for path in sorted(place.glob("*.json"))}
    if not stored:
        return None, "no baseline is stored"
    baseline = stored.get(machine.file_name(kind))
    if baseline is None or baseline.machine != kind:
        differing = sorted((machine.differences(one.machine, kind) for one in stored.values()), key=len)
        return None, f"no baseline is stored for this kind of machine ({'; '.join(differing[0])})"
    if baseline.digest != digest:
        return None, "what is timed, or the reference workload, is another than that of the stored baseline"
    return baseline, ""


Decide = Callable[[Sequence[str]], Sequence[Versus]]
"""The working tree against the code whose ratios are stored, of some subjects."""


def judge(
    names: Sequence[str],
    stored: Baseline | None,
    first: Sitting,
    again: Callable[[Sequence[str]], Sitting],
    decide: Decide,
    margin: float = MARGIN,
) -> list[Judged]:
    """Compare a sitting with the stored ratios, and look closer at what seems slow.

    What other machines' work does to this one moves ratios for minutes, by up to 40 per cent. So a ratio
    beyond `SUSPECT` raises a suspicion only. It is decided by measuring both codes in turns; where
    the other is not at hand, or has no such subject, by `SITTINGS` processes whose median must lie beyond it.

    Parameters
    ----------
    again
        Measures some subjects in a fresh process.
    decide
        Measures some subjects in turns with the code whose ratios are stored; nothing if that is not at hand.
    """
    old = {name: stored.ratios[name] for name in names if stored is not None and name in stored.ratios}
    ratios = {name: [timing.ratio] for name, timing in first.timings.items()}
    suspects = [name for name in old if name in ratios and ratios[name][0] > old[name] * (1 + min(SUSPECT, margin))]
    failed = {name: "not measured" for name in names if name not in ratios} | dict(first.failed)
    decided = decide(suspects) if suspects else ()
    against = {one.name: one for one in decided if not one.reason}
    undecided = [name for name in suspects if name not in against]
    for _ in range(SITTINGS - 1 if undecided else 0):
        sitting = again(undecided)
        failed |= sitting.failed
        for name, timing in sitting.timings.items():
            ratios[name].append(timing.ratio)

    def judged(name: str) -> Judged:
        if name in failed:
            return Judged(name, "failed", None, stored=old.get(name, float("nan")), reason=failed[name])
        found = Judged(name, "ok", first.timings[name], tuple(ratios[name]), old.get(name, float("nan")))
        if name not in old:
            return evolve(found, verdict="new")
        if name in against:
            slower, unsure = (against[name].verdict(margin) == word for word in ("slower", "unsure"))
            return evolve(found, verdict="slower" if slower else "unsure" if unsure else "ok", against=against[name])
        if found.change > margin:
            return evolve(found, verdict="slower")
        return evolve(found, verdict="faster" if found.change < 1 / (1 + margin) - 1 else "ok")

    return [judged(name) for name in names]


def establish(tree: Tree, names: Sequence[str], rounds: int = ROUNDS, progress: Progress = lambda _: None) -> Baseline:
    """Of `UPDATES` fresh processes, for each subject that in which the reference took least.

    Raises
    ------
    UserError
        If a subject cannot be measured.
    """
    done: list[Sitting] = []
    for number in range(UPDATES):
        progress(f"process {number + 1} of {UPDATES}")
        done.append(sit(tree, names, rounds))
        for name, reason in done[-1].failed.items():
            raise UserError(f"{name} cannot be measured: {reason}")
    calmest = {name: min((one.timings[name] for one in done), key=lambda timing: timing.reference) for name in names}
    ratios = {name: one.ratio for name, one in calmest.items()}
    return Baseline(machine.kind(), done[0].digest, code_digest(tree.code), ratios)
