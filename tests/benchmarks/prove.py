"""Is a slow-down of 1.3 caught, and unchanged code left in peace? Counts both, with `matbench bench` itself.

    python tests/benchmarks/prove.py --tries 20 --folder ../proof
    python tests/benchmarks/prove.py --tries 20 --folder ../proof --load
    python tests/benchmarks/prove.py --tries 5 --folder ../proof --load --only base

The checkout is copied, and ratios are stored from the copy. Then, in turns: the unchanged copy is measured
with all subjects, and any alarm is a false one; and copies in whose source a kernel does 30 % more of its
own work are measured, which must be caught. Kernels whose ratios load moves too far are left out and named:
``--only base`` measures each planted copy, and a second unchanged one, against the unchanged copy in turns,
as `matbench bench --base` does. With ``--load``, meanwhile one process per core streams memory. The last
line is JSON. With ``--folder DIR`` copies and ratios stay there, for the calls that follow: delete it when
the code has changed.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

from matbench.bench import baselines
from matbench.bench.base import compare
from matbench.bench.load import load
from matbench.bench.measuring import Tree

HERE = Path(__file__).resolve().parents[2]
FOLDERS = ("algorithms", "datasets", "reports", "matbench", "tests")


class Plant(NamedTuple):
    """Changes of a source file after which a kernel goes over 30 % of its rows once more."""

    subject: str
    file: str
    changes: tuple[tuple[str, str], ...]


def _again(rows: str) -> str:
    return f"range(({rows} * 13 + 9) // 10)"


PLANTS = (
    Plant(
        "semi-global",
        "algorithms/semiglobal.py",
        (
            (
                "    for row in range(height):\n        y = row if forward else height - 1 - row\n",
                f"    for turn in {_again('height')}:\n        row = turn % height\n"
                "        y = row if forward else height - 1 - row\n",
            ),
        ),
    ),
    Plant(
        "winner",
        "algorithms/semiglobal.py",
        (
            (
                "    for y in range(height):\n        for x in range(width):\n            sums",
                f"    for turn in {_again('height')}:\n        y = turn % height\n"
                "        for x in range(width):\n            sums",
            ),
        ),
    ),
    Plant(
        "support",
        "algorithms/fusion.py",
        (
            (
                "    for row in range(out.shape[0]):\n        for x in range(out.shape[1]):\n            _weights",
                f"    for turn in {_again('out.shape[0]')}:\n        row = turn % out.shape[0]\n"
                "        for x in range(out.shape[1]):\n            _weights",
            ),
        ),
    ),
    Plant(
        "better half",
        "algorithms/fusion.py",
        (
            (
                "        for y in range(rho.shape[0]):\n            for p in range(count):\n",
                f"        for turn in {_again('rho.shape[0]')}:\n            y = turn % rho.shape[0]\n"
                "            for p in range(count):\n",
            ),
        ),
    ),
    Plant(
        "passes",
        "algorithms/materiality/passes.py",
        (
            (
                "        over_rows(borrow, self.space.rows, threads, share(self.space.rows, threads))\n",
                "        over_rows(borrow, self.space.rows, threads, share(self.space.rows, threads))\n"
                "        over_rows(borrow, (self.space.rows * 3 + 9) // 10, threads, share(self.space.rows, threads))\n",  # noqa: E501
            ),
        ),
    ),
)


def copy_checkout(to: Path, plant: Plant | None = None) -> Path:
    """A copy of the code and its benchmarks; planted if told so. One that is there already stays as it is."""
    if to.is_dir():
        return to
    hidden = shutil.ignore_patterns("__pycache__", ".*", "runs")
    for name in FOLDERS:
        shutil.copytree(HERE / name, to / name, symlinks=True, ignore=hidden)
    shutil.copy(HERE / "pyproject.toml", to)
    if plant is not None:
        (to / plant.file).write_text(planted(plant), encoding="utf-8")
    return to


def planted(plant: Plant) -> str:
    """The source file with the slow-down in it."""
    text = (HERE / plant.file).read_text(encoding="utf-8")
    for before, after in plant.changes:
        if text.count(before) != 1:
            raise SystemExit(f"{plant.file} has changed: mend what PLANTS says of {plant.subject!r}")
        text = text.replace(before, after)
    return text


def bench(code: Path, cache: Path, *arguments: str) -> tuple[int, dict[str, Any]]:
    """`matbench bench --json` of a copy: its exit status and what it said."""
    done = subprocess.run(
        [sys.executable, "-m", "matbench", "bench", "--json", *arguments],
        cwd=code,
        env={**os.environ, "XDG_CACHE_HOME": str(cache)},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode not in (0, 3):
        raise SystemExit(f"matbench bench ended with {done.returncode}: {done.stderr.strip()[-400:]}")
    return done.returncode, json.loads(done.stdout)


def _slower(found: dict[str, Any]) -> dict[str, float]:
    return {one["name"]: one["change"] for one in found["times"] if one["verdict"] == "slower"}


class Proof:
    """Copies of the code in a folder, and the ratios that are stored of the unchanged one."""

    def __init__(self, place: Path, margin: str):
        self._place, self._cache = place, place / "cache"
        self._stored = ("--baselines", str(place / "baselines"))
        self._judged = ("--no-work", "--margin", margin, *self._stored)
        self.clean = copy_checkout(place / "clean")
        if not (place / "baselines").is_dir():
            print("storing ratios of the unchanged copy, without and with load", flush=True)
            bench(self.clean, self._cache, "--update", "--no-work", *self._stored)
        (stored,) = baselines.read(place / "baselines")
        self.steady = [plant for plant in PLANTS if stored.ratios[plant.subject].steady]
        for plant in PLANTS:
            ratio = stored.ratios[plant.subject]
            left = "" if plant in self.steady else ": left to --only base"
            print(f"{plant.subject:12} with load {ratio.loaded / ratio.quiet - 1:+.1%}{left}", flush=True)
        self._planted = {
            plant.subject: copy_checkout(place / plant.subject.replace(" ", "-"), plant) for plant in PLANTS
        }

    def compile(self, plants: Sequence[Plant]) -> None:
        """Before anything is counted."""
        for plant in plants:
            self.catch(plant, "--rounds", "5")

    def catch(self, plant: Plant, *more: str) -> dict[str, Any]:
        """Measure a planted copy once."""
        code = self._planted[plant.subject]
        _, found = bench(code, self._cache, "--only", plant.subject, *more, *self._judged)
        (one,) = found["times"]
        return {"subject": plant.subject, "caught": one["verdict"] == "slower", "change": one["change"]}

    def alarms(self) -> tuple[dict[str, float], float]:
        """Measure the unchanged copy once: what is called slower, and the greatest change."""
        _, found = bench(self.clean, self._cache, *self._judged)
        return _slower(found), max(one["change"] for one in found["times"])

    def against(self, plant: Plant | None, subject: str) -> dict[str, Any]:
        """Measure a planted copy, or a second unchanged one, against the unchanged copy in turns."""
        code = self._planted[subject] if plant else copy_checkout(self._place / "twin")
        trees = [Tree(each, Path(sys.executable), self._place / "kernels" / each.name) for each in (code, self.clean)]
        (found,) = compare(*trees, [subject], progress=lambda _: None)
        verdict = found.verdict(baselines.MARGIN)
        return {"subject": subject, "caught": verdict == "slower", "change": found.ratio - 1, "low": found.low - 1}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tries", type=int, default=20, help="of either kind")
    parser.add_argument("--load", action="store_true", help="with other work on every core")
    parser.add_argument(
        "--only", choices=("caught", "alarms", "base"), help="one of the two counts, or those of --base"
    )
    parser.add_argument("--folder", type=Path, help="keep copies and ratios there; default: nothing is kept")
    parser.add_argument("--margin", default=str(baselines.MARGIN))
    asked = parser.parse_args()
    if asked.tries < 1:
        parser.error(f"--tries {asked.tries}: at least 1")
    catches: list[dict[str, Any]] = []
    alarms: list[Mapping[str, float]] = []
    worst: list[float] = []
    with tempfile.TemporaryDirectory(prefix="matbench-proof-") as passing:
        proof = Proof((asked.folder or Path(passing)).resolve(), asked.margin)
        plants: Sequence[Plant] = PLANTS if asked.only == "base" else proof.steady
        if asked.only in (None, "caught"):
            proof.compile(plants)
        began = time.monotonic()
        with load(asked.load):
            for number in range(asked.tries):
                if asked.only != "alarms" and plants:
                    plant = plants[number % len(plants)]
                    one = proof.against(plant, plant.subject) if asked.only == "base" else proof.catch(plant)
                    catches.append(one)
                    said = "caught" if one["caught"] else "missed"
                    print(f"{number + 1:3} planted in {plant.subject:12} {one['change']:+.1%} {said}", flush=True)
                if asked.only == "base":
                    one = proof.against(None, plants[number % len(plants)].subject)
                    alarms.append({one["subject"]: one["change"]} if one["caught"] else {})
                    worst.append(one["change"])
                elif asked.only != "caught":
                    found, change = proof.alarms()
                    alarms.append(found)
                    worst.append(change)
                if asked.only != "caught":
                    said = ", ".join(alarms[-1]) or "no alarm"
                    print(f"{number + 1:3} unchanged: {said}; the slowest {worst[-1]:+.1%}", flush=True)
    changes = {p.subject: [c["change"] for c in catches if c["subject"] == p.subject] for p in PLANTS}
    summary = {
        "load": asked.load,
        "tries": asked.tries,
        "left_to_base": [plant.subject for plant in PLANTS if plant not in plants],
        "caught": sum(c["caught"] for c in catches),
        "planted": len(catches),
        "measured": {name: median(found) for name, found in changes.items() if found},
        "least_measured": min((c["change"] for c in catches), default=None),
        "false_alarms": sum(map(bool, alarms)),
        "unchanged": len(alarms),
        "largest_change_of_unchanged": max(worst, default=None),
        "minutes": round((time.monotonic() - began) / 60, 1),
    }
    print(f"caught {summary['caught']} of {len(catches)}; false alarms {summary['false_alarms']} of {len(alarms)}")
    print(json.dumps(summary))


if __name__ == "__main__":
    main()
