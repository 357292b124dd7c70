"""Is a slow-down of 1.3 caught, and unchanged code left in peace? Counts both, with `matbench bench` itself.

    python tests/benchmarks/prove.py --tries 20
    python tests/benchmarks/prove.py --tries 20 --load

The checkout is copied, and ratios are stored from the copy. Then, in turns: the unchanged copy is measured
with all subjects, and any alarm is a false one; and copies in whose source a kernel does 30 % more of its
own work are measured, which must be caught. With ``--load``, meanwhile one process per core streams
memory; ratios are stored before the load begins, as they are in life. The last line is JSON. With
``--folder DIR`` copies and ratios stay there, and a second call (with ``--load``, say) is judged by the same.
"""

import argparse
import json
import multiprocessing
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

import numpy as np

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
        "pass",
        "algorithms/materiality/passes.py",
        (
            (
                "        over_rows(borrow, self.space.rows, threads, share(self.space.rows, threads))\n",
                "        over_rows(borrow, self.space.rows, threads, share(self.space.rows, threads))\n"
                "        over_rows(borrow, (self.space.rows * 3 + 9) // 10, threads, share(self.space.rows, threads))\n",
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
        path = to / plant.file
        text = path.read_text(encoding="utf-8")
        for before, after in plant.changes:
            if text.count(before) != 1:
                raise SystemExit(f"{plant.file} has changed: mend what PLANTS says of {plant.subject!r}")
            text = text.replace(before, after)
        path.write_text(text, encoding="utf-8")
    return to


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


def _stream() -> None:
    a, b = np.ones((2, 1 << 24), np.float32)
    while True:
        np.multiply(a, 1.0001, out=b)
        np.add(b, a, out=a)
        np.minimum(a, 1, out=a)


@contextmanager
def load(wanted: bool) -> Iterator[None]:
    """Other work on every core: memory streamed, 128 MiB a process."""
    others = [multiprocessing.Process(target=_stream, daemon=True) for _ in range((os.cpu_count() or 1) * wanted)]
    for other in others:
        other.start()
    try:
        yield
    finally:
        for other in others:
            other.kill()
            other.join()


def _slower(found: dict[str, Any]) -> dict[str, float]:
    return {one["name"]: one["change"] for one in found["times"] if one["verdict"] == "slower"}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tries", type=int, default=20, help="of either kind")
    parser.add_argument("--load", action="store_true", help="with other work on every core")
    parser.add_argument("--only", choices=("caught", "alarms"), help="one of the two counts")
    parser.add_argument("--folder", type=Path, help="keep copies and ratios there; default: nothing is kept")
    parser.add_argument("--margin", default="0.15")
    asked = parser.parse_args()
    if asked.tries < 1:
        parser.error(f"--tries {asked.tries}: at least 1")
    began = time.monotonic()
    catches: list[dict[str, Any]] = []
    alarms: list[dict[str, float]] = []
    worst: list[float] = []
    with tempfile.TemporaryDirectory(prefix="matbench-proof-") as passing:
        place = (asked.folder or Path(passing)).resolve()
        cache = place / "cache"
        stored = ("--baselines", str(place / "baselines"))
        clean = copy_checkout(place / "clean")
        if not (place / "baselines").is_dir():
            print("storing ratios of the unchanged copy", flush=True)
            few = [f"--only={plant.subject}" for plant in PLANTS if asked.only == "caught"]
            bench(clean, cache, "--update", "--no-work", *few, *stored)
        planted = {p.subject: copy_checkout(place / p.subject.replace(" ", "-"), p) for p in PLANTS}
        judged = ("--no-work", "--margin", asked.margin, *stored)
        if asked.only != "alarms":
            for subject, code in planted.items():  # compiled before anything is counted
                bench(code, cache, "--only", subject, "--rounds", "5", *judged)
        with load(asked.load):
            for number in range(asked.tries):
                if asked.only != "alarms":
                    plant = PLANTS[number % len(PLANTS)]
                    status, found = bench(planted[plant.subject], cache, "--only", plant.subject, *judged)
                    one = found["times"][0]
                    catches.append({"subject": plant.subject, "caught": status == 3, "change": one["change"]})
                    print(
                        f"{number + 1:3} planted in {plant.subject:12} {one['change']:+.1%} {one['verdict']}",
                        flush=True,
                    )
                if asked.only != "caught":
                    _, found = bench(clean, cache, *judged)
                    alarms.append(_slower(found))
                    worst.append(max(one["change"] for one in found["times"]))
                    said = ", ".join(alarms[-1]) or "no alarm"
                    print(f"{number + 1:3} unchanged: {said}; the slowest {worst[-1]:+.1%}", flush=True)
    changes = {p.subject: [c["change"] for c in catches if c["subject"] == p.subject] for p in PLANTS}
    summary = {
        "load": asked.load,
        "tries": asked.tries,
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
