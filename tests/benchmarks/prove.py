"""Is a slow-down of 1.3 caught, and unchanged code left in peace? Counts both, with `matbench bench` itself.

    python tests/benchmarks/prove.py --tries 20 --folder ../proof
    python tests/benchmarks/prove.py --tries 20 --folder ../proof --load

The checkout is copied into a git repository of its own, and the ratios that are stored there are committed.
Then, in turns: the unchanged copy is measured with all subjects, and any alarm is a false one; and copies in
whose source a kernel does 30 % more of its own work are measured, which must be caught. With ``--load``,
meanwhile one process per core streams memory. The last line is JSON. With ``--folder DIR`` copies and ratios
stay there, for the calls that follow: delete it when the code has changed.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

from load import load

from matbench.bench import baselines

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
        "algorithms/paths.py",
        (
            (
                "    for row in range(first, end):\n        y, y_old",
                f"    for turn in {_again('(end - first)')}:\n        row = first + turn % (end - first)\n"
                "        y, y_old",
            ),
        ),
    ),
    Plant(
        "winner",
        "algorithms/semiglobal.py",
        (
            (
                "    for y in range(height):\n        sums",
                f"    for turn in {_again('height')}:\n        y = turn % height\n        sums",
            ),
        ),
    ),
    Plant(
        "support",
        "algorithms/support.py",
        (
            (
                "    for row in range(out.shape[0]):\n        _shares",
                f"    for turn in {_again('out.shape[0]')}:\n        row = turn % out.shape[0]\n        _shares",
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
        "algorithms/materiality/objective.py",
        (
            (
                "        over_rows(borrow, self.space.rows, threads, share(self.space.rows, threads))\n",
                "        over_rows(borrow, self.space.rows, threads, share(self.space.rows, threads))\n"
                "        over_rows(borrow, (self.space.rows * 3 + 9) // 10, threads, share(self.space.rows, threads))\n",  # noqa: E501
            ),
        ),
    ),
    Plant(
        "uniting",
        "algorithms/cuts/contraction.py",
        (
            # no index that must be computed: that alone would double the time
            (
                "    for k in range(tails.size):\n        if forth",
                "    for part in range(2):\n"
                "      for k in range(tails.size if part == 0 else (tails.size * 3 + 9) // 10):\n        if forth",
            ),
            (
                "    for u in range(member.size):\n        member[u] = member[member[u]]  #",
                "    for part in range(2):\n"
                "      for u in range(member.size if part == 0 else (member.size * 3 + 9) // 10):\n"
                "        member[u] = member[member[u]]  #",
            ),
        ),
    ),
    Plant(
        "contraction",
        "algorithms/cuts/contraction.py",
        (
            (
                "    nodes = unite(*links, member)\n",
                "    part = links[:, : (links.shape[1] * 3 + 9) // 10]\n    nodes = unite(*part, member)\n"
                "    more = np.zeros(nodes + 1, np.int32), np.empty_like(part)\n"
                "    merge(member, nodes, part.copy(), excess, left, *more)\n"
                "    nodes = unite(*links, member)\n",
            ),
        ),
    ),
    Plant(
        "handing on",
        "algorithms/cuts/handing_on.py",
        (("    for sweep in range(2 * sweeps):\n", f"    for sweep in {_again('2 * sweeps')}:\n"),),
    ),
)


def copy_checkout(to: Path) -> Path:
    """A copy of the code and its benchmarks, without what is stored of machines."""
    hidden = shutil.ignore_patterns("__pycache__", ".*", "runs", "baselines")
    for name in FOLDERS:
        shutil.copytree(HERE / name, to / name, symlinks=True, ignore=hidden)
    shutil.copy(HERE / "pyproject.toml", to)
    return to


def planted(plant: Plant) -> str:
    """The source file with the slow-down in it."""
    text = (HERE / plant.file).read_text(encoding="utf-8")
    for before, after in plant.changes:
        if text.count(before) != 1:
            raise SystemExit(f"{plant.file} has changed: mend what PLANTS says of {plant.subject!r}")
        text = text.replace(before, after)
    return text


def repository(code: Path) -> None:
    """What is in a folder, as the first or the next commit of a git repository."""
    whose = {"user.name": "Proof", "user.email": "proof@example.org", "commit.gpgsign": "false"}
    git = ["git", "-C", str(code), *(word for item in whose.items() for word in ("-c", "=".join(item)))]
    for arguments in (["init", "-q"], ["add", "-A"], ["commit", "-q", "--allow-empty", "-m", "as it is"]):
        subprocess.run([*git, *arguments], check=True)


def bench(code: Path, cache: Path, *arguments: str) -> dict[str, Any]:
    """What `matbench bench --json` says of a copy."""
    done = subprocess.run(
        [sys.executable, "-m", "matbench", "bench", "--json", "--no-work", *arguments],
        cwd=code,
        env={**os.environ, "XDG_CACHE_HOME": str(cache)},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode not in (0, 3):
        raise SystemExit(f"matbench bench ended with {done.returncode}: {done.stderr.strip()[-400:]}")
    found: dict[str, Any] = json.loads(done.stdout)
    if "--update" not in arguments and not (found["judged"] and found["accepted"]):
        raise SystemExit(f"{code} has no ratios of its own for this machine: delete {code.parent}, and prove it anew")
    return found


class Proof:
    """Copies of the code in a folder, each with what the unchanged one stored in its last commit."""

    def __init__(self, place: Path, margin: str):
        self._cache, self._margin = place / "cache", margin
        self.clean = place / "clean"
        if not self.clean.is_dir():
            print("storing ratios of the unchanged copy", flush=True)
            repository(copy_checkout(self.clean))
            bench(self.clean, self._cache, "--update")
            repository(self.clean)
        self._planted = {plant.subject: place / plant.subject.replace(" ", "-") for plant in PLANTS}
        for plant in PLANTS:
            code = self._planted[plant.subject]
            if not code.is_dir():
                shutil.copytree(self.clean, code, symlinks=True, ignore=shutil.ignore_patterns("__pycache__"))
                (code / plant.file).write_text(planted(plant), encoding="utf-8")

    def compile(self) -> None:
        """Before anything is counted."""
        for plant in PLANTS:
            self.catch(plant, "--rounds", "5")

    def catch(self, plant: Plant, *more: str) -> dict[str, Any]:
        """Measure a planted copy once."""
        code = self._planted[plant.subject]
        (one,) = bench(code, self._cache, "--only", plant.subject, "--margin", self._margin, *more)["times"]
        return {"subject": plant.subject, "caught": one["verdict"] == "slower", "change": one["change"]}

    def alarms(self) -> tuple[list[str], dict[str, float]]:
        """Measure the unchanged copy once: what is called slower; how much slower is what was looked at closer."""
        times = bench(self.clean, self._cache, "--margin", self._margin)["times"]
        closer = {one["name"]: one["change"] for one in times if one["against"]}
        return [one["name"] for one in times if one["verdict"] == "slower"], closer


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tries", type=int, default=20, help="of either kind")
    parser.add_argument("--load", action="store_true", help="with other work on every core")
    parser.add_argument("--only", choices=("caught", "alarms"), help="one of the two counts")
    parser.add_argument("--folder", type=Path, help="keep copies and ratios there; default: nothing is kept")
    parser.add_argument("--margin", default=str(baselines.MARGIN))
    asked = parser.parse_args()
    if asked.tries < 1:
        parser.error(f"--tries {asked.tries}: at least 1")
    catches: list[dict[str, Any]] = []
    alarms: list[list[str]] = []
    closer: list[dict[str, float]] = []
    with tempfile.TemporaryDirectory(prefix="matbench-proof-") as passing:
        proof = Proof((asked.folder or Path(passing)).resolve(), asked.margin)
        if asked.only != "alarms":
            proof.compile()
        began = time.monotonic()
        with load(asked.load):
            for number in range(asked.tries):
                if asked.only != "alarms":
                    one = proof.catch(PLANTS[number % len(PLANTS)])
                    catches.append(one)
                    said = "caught" if one["caught"] else "missed"
                    print(f"{number + 1:3} planted in {one['subject']:12} {one['change']:+.1%} {said}", flush=True)
                if asked.only != "caught":
                    slower, looked_at = proof.alarms()
                    alarms.append(slower)
                    closer.append(looked_at)
                    said = ", ".join(f"{name} {change:+.1%}" for name, change in looked_at.items()) or "nothing"
                    told = f"called slower: {', '.join(slower)}" if slower else "no alarm"
                    print(f"{number + 1:3} unchanged: {told}; measured in turns: {said}", flush=True)
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
        "measured_in_turns": sum(map(len, closer)),
        "largest_change_in_turns": max((change for one in closer for change in one.values()), default=None),
        "minutes": round((time.monotonic() - began) / 60, 1),
    }
    print(f"caught {summary['caught']} of {len(catches)}; false alarms {summary['false_alarms']} of {len(alarms)}")
    print(json.dumps(summary))


if __name__ == "__main__":
    main()
