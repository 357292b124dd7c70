"""Baselines: the stored ratios for each kind of machine, and the judgement whether a subject has become slower."""

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
from matbench.files.documents import read_json

MARGIN = 0.15
"""How much slower than the stored code a subject may be, as a share of its time."""

SUSPECT = 0.1
"""How far above the stored ratio a subject must lie for a closer look, as a share; the margin, if that is smaller."""

SITTINGS = 3
"""Processes whose median decides, where the commit that stored a ratio is not at hand."""

_MOST = 1 << 22  # bytes of a baseline

UPDATES = 5
"""Processes when ratios are stored. For each subject the one counts in which the reference was quickest:
the process that other work on the machine disturbed least."""

Verdict = Literal["ok", "slower", "faster", "unsure", "new", "failed"]


@frozen
class Baseline:
    """What is stored for one kind of machine.

    Parameters
    ----------
    machine
        See `machine.kind`.
    digest
        Digest of the reference workload, in units of which ratios are given, and of the subjects.
    code
        Digest of the methods' code that was measured, see `code_digest`.
    ratios
        Subject -> its ratio, from the process that was disturbed least.
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
        From the first sitting; None if it could not be measured.
    ratios
        One ratio from each sitting.
    stored
        The stored ratio; NaN if there is none.
    against
        The working tree compared in turns with the stored code; None where that was not needed.
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
        """The median of the sittings' ratios."""
        return median(self.ratios) if self.ratios else float("nan")

    @property
    def change(self) -> float:
        """How much slower than the stored code, as a share: measured in turns if possible, else by the ratios."""
        return self.against.ratio - 1 if self.against else self.ratio / self.stored - 1


def folder(tree: Tree) -> Path:
    """Where a checkout keeps its baselines."""
    return tree.code / BENCHMARKS / "baselines"


def code_digest(code: Path) -> str:
    """SHA-256 of the code of all methods of a checkout."""
    digest = sha256()
    for file in sorted((code / "algorithms").rglob("*.py")):
        digest.update(f"{file.relative_to(code).as_posix()}\0".encode() + file.read_bytes())
    return digest.hexdigest()


def read(place: Path) -> list[Baseline]:
    """All baselines in a folder.

    Raises
    ------
    UserError
        If a file there is not a baseline.
    """
    return [_read(path) for path in sorted(place.glob("*.json"))]


def _read(path: Path) -> Baseline:
    try:
        return cattrs.structure(read_json(path, most=_MOST), Baseline)
    except Exception as error:
        raise UserError(f"{path} is no stored baseline: delete it, or write it anew with --update") from error


def replaced(place: Path, baseline: Baseline) -> Baseline | None:
    """The stored baseline that a new one will replace; None if there is none that fits the reference workload."""
    try:
        before = _read(place / machine.file_name(baseline.machine))
    except UserError:
        return None
    return before if before.digest == baseline.digest else None


def store_baseline(place: Path, baseline: Baseline) -> Path:
    """Store a baseline, in place of the one for the same kind of machine; its path."""
    path = place / machine.file_name(baseline.machine)
    place.mkdir(parents=True, exist_ok=True)
    digits = {name: float(f"{ratio:.4g}") for name, ratio in sorted(baseline.ratios.items())}  # the rest is noise
    content = {**cattrs.unstructure(baseline), "ratios": digits}
    path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    return path


def matching(place: Path, kind: Mapping[str, str], digest: str) -> tuple[Baseline | None, str]:
    """The baseline of this kind of machine; else None and, in words, how the nearest one differs.

    Raises
    ------
    UserError
        If a file there is not a baseline.
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
"""Compares the working tree with the stored code in turns, for some subjects."""


def judge(
    names: Sequence[str],
    stored: Baseline | None,
    first: Sitting,
    again: Callable[[Sequence[str]], Sitting],
    decide: Decide,
    margin: float = MARGIN,
) -> list[Judged]:
    """Compare a sitting with the stored ratios, and look closer at what seems slow.

    Other work on the same host moves ratios for minutes, by up to 40 per cent. So a ratio beyond `SUSPECT`
    only makes a subject suspect. The suspicion is settled by measuring both codes in turns. Where the stored
    code is not at hand, or lacks the subject, the median of `SITTINGS` processes must lie beyond the margin.

    Parameters
    ----------
    stored
        The baseline; None if there is none, and then no subject is judged.
    again
        Measures some subjects in a fresh process.
    decide
        Measures some subjects in turns with the stored code; gives nothing if that is not at hand.
    """
    old = {name: stored.ratios[name] for name in names if stored is not None and name in stored.ratios}
    ratios = {name: [timing.ratio] for name, timing in first.timings.items()}
    # only what looks slow is measured again: a false "faster" fails nobody's build
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
    """Measure a new baseline in `UPDATES` processes; the one with the quickest reference counts for each subject.

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
