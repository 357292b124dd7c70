"""Methods that fight those who watch them: each costs its own cell, no other, and leaves nothing behind.

``python tests/proofs/hostile_methods.py`` has all of them fight, group by group (numbers choose groups, from 0); the
tests take some of each.
"""

import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import psutil

sys.path.insert(0, str(Path(__file__).parents[1]))

from hostile import SLEEPS
from places import HOSTILE

from matbench.solving.confinement import UNCONFINED

FAIR = ("ok", "")
PATIENCE = 600
"""Seconds without a finished cell after which a run is stuck: many times a cell's time-out, for a busy machine."""
FIGHTS = {
    "kills_keeper": ("crashed", "its keeper was killed"),
    "kills_keeper[clean=true]": ("crashed", "its keeper was killed"),
    "kills_server": ("crashed", "its keeper was killed"),
    "stops_server": ("crashed", "its keeper was killed"),
    "multiplies": FAIR,
    "closes": ("crashed", "ended its process (exit status 0)"),
    "quits": ("crashed", "ended its process (exit status 0)"),
    "babbles": ("crashed", "wrote into a file of the harness"),
    "babbles[what=long]": ("crashed", "wrote into a file of the harness"),
    "babbles[what=early]": ("crashed", "wrote into a file of the harness"),
    "holds_output": FAIR,
    "eats_in_children": ("out-of-memory", "400 MiB are its limit"),
}
"""Method -> status of its cell and part of the reason."""
WAITS = {
    "stops_keeper": ("crashed", "its keeper was stopped"),
    "deaf": ("timeout", "stopped after "),
    "stops_itself": ("timeout", "stopped after "),
    "babbles[what=half]": ("timeout", "stopped after "),
}
"""The same for those that only wait."""
LEFT = {
    **{f"answers[what={what}]": ("failed", "and no file") for what in ("pipe", "endless", "socket", "deep")},
    "answers[what=device]": ("failed", "not permitted"),  # it has no right to make one
    "answers[what=sparse]": ("failed", "1099511627776 bytes"),
    "answers[file=outcome.json what=pipe]": ("failed", "and no file"),
    "answers[file=outcome.json what=endless]": ("failed", "and no file"),
    "answers[file=volume.npz what=shut]": ("failed", "and no file"),
    "spoils": ("failed", "could not be solved or stored"),
    "spoils[what=pipe]": ("failed", "could not be solved or stored"),
    "spoils[file=views.npz what=pipe]": ("failed", "the views of its scene were changed"),
    "spoils[file=views.npz what=endless]": ("failed", "the views of its scene were changed"),
    "spoils[file=answer what=pipe]": ("failed", "could not be solved or stored"),
    "spoils[file=other what=deep]": FAIR,
    "spoils[file=answer/other what=deep]": FAIR,
}
"""The same for what they leave where they answer."""
DRAFTS = {
    **{f"drafts[what={what}]": FAIR for what in ("pipe", "victim", "endless", "device", "deep", "shut", "sparse")},
    "drafts[file=cell.json what=pipe]": FAIR,
    "drafts[file=disparity.npz what=pipe]": FAIR,
    "drafts[file=. what=victim]": ("failed", "could not be solved or stored"),
    "drafts[file=. what=pipe]": ("failed", "could not be solved or stored"),
}
"""The same for what they put into the cell's own folder, where that is within their reach."""


class Place:
    """A run that is started by the command line, with its own folder for temporary files."""

    def __init__(self, folder: Path, **environment: str) -> None:
        self.run, self.temporary, self.victim = (folder / name for name in ("run", "t", "victim"))
        self.temporary.mkdir()
        self.victim.mkdir()
        (self.victim / "file").write_text("precious")
        own = {"TMPDIR": self.temporary, "CELLS": self.run / "cells", "VICTIM": self.victim}
        self.environment = {
            **os.environ,
            **{name: str(path) for name, path in own.items()},
            "PYTHONFAULTHANDLER": "1",
            **environment,
        }

    def start(self, *algorithms: str, timeout: float, jobs: int) -> subprocess.Popen[str]:
        line = [
            sys.executable,
            "-m",
            "matbench",
            "compare",
            "--plugin",
            str(HOSTILE),
            "-s",
            "synthetic/box[size=96x72]",
        ]
        line += ["--out", str(self.run), "--timeout", str(timeout), "--memory", "400", "--jobs", str(jobs), "--quiet"]
        for algorithm in algorithms:
            line += ["-a", algorithm]
        pipe = subprocess.PIPE
        return subprocess.Popen(line, env=self.environment, stdout=pipe, stderr=subprocess.STDOUT, text=True)

    def outcomes(self) -> dict[frozenset[str], tuple[str, str]]:
        """Method -> status and reason."""
        found = {}
        for path in self.run.glob("cells/*/cell.json"):
            facts = json.loads(path.read_text())
            changed, outcome = facts["cell"]["method"]["changed"], facts["outcome"]
            found[_words(f"{facts['cell']['method']['algorithm']} {changed}")] = outcome["status"], outcome["reason"]
        return found

    def left(self) -> list[str]:
        """What is there that should not be: processes, drafts, temporary folders."""
        mine = []
        for process in psutil.process_iter():
            try:
                line, environment = process.cmdline(), process.environ()
            except psutil.Error:
                continue
            if SLEEPS in line or environment.get("TMPDIR") == str(self.temporary):
                mine.append(f"{process.pid} {line}")
        return mine + [str(path) for place in (self.run / "cells", self.temporary) for path in place.glob(".*")]


def _words(name: str) -> frozenset[str]:
    """A method's name and parameters, in whatever order."""
    return frozenset(re.findall(r"[^][ ,]+", name))


@contextmanager
def short_folder() -> Iterator[Path]:
    """A folder with a short path: below it lie sockets, whose paths must be short."""
    with tempfile.TemporaryDirectory(prefix="mb-") as place:
        yield Path(place)


def _said(place: Place, run: subprocess.Popen[str]) -> str:
    """What a run has printed at its end. It may take any time while its cells come in, and is killed if none does."""
    known, since = -1, time.monotonic()
    while True:
        try:
            return run.communicate(timeout=1)[0]
        except subprocess.TimeoutExpired:
            count = len(list(place.run.glob("cells/*/cell.json")))
            if count > known:
                known, since = count, time.monotonic()
            if time.monotonic() - since > PATIENCE:
                run.send_signal(signal.SIGABRT)  # it prints where it is stuck
                raise AssertionError(f"stuck after {count} cells: {run.communicate()[0]}") from None


def _wait_until_nothing_is_left(place: Place) -> None:
    """What was killed goes when the system comes to it."""
    end = time.monotonic() + 10
    while place.left() and time.monotonic() < end:
        time.sleep(0.1)
    left = place.left() + [str(path) for path in place.temporary.glob("matbench-*")]
    assert not left, f"left: {left}"


def fought(place: Place, expected: dict[str, tuple[str, str]], timeout: float = 60, jobs: int = 1) -> None:
    """Have methods fight; all must be as it is expected afterwards."""
    with place.start(*expected, "fair", timeout=timeout, jobs=jobs) as run:
        said = _said(place, run)
    found = place.outcomes()
    wanted = {_words(name): one for name, one in {**expected, "fair": FAIR}.items()}
    assert len(found) == len(wanted), said
    wrong = {
        " ".join(name): found.get(name)
        for name, (status, reason) in wanted.items()
        if name not in found or found[name][0] != status or reason not in found[name][1]
    }
    assert not wrong, f"{wrong}\n{said}"
    _wait_until_nothing_is_left(place)
    assert [path.name for path in place.victim.iterdir()] == ["file"], "what a link led to has been changed"
    assert (place.victim / "file").read_text() == "precious"


GROUPS: list[tuple[dict[str, tuple[str, str]], float, int, dict[str, str]]] = [
    (FIGHTS, 60, 1, {}),
    (WAITS, 20, 4, {}),
    (LEFT, 60, 1, {}),
    (DRAFTS, 60, 1, {UNCONFINED: "1"}),
    ({**FIGHTS, **LEFT}, 60, 1, {UNCONFINED: "1"}),
]
"""Methods, the time-out of a cell, how many run at once, and what is set."""


def main(groups: Sequence[int]) -> int:
    """All that are known, or those of some groups; how many groups were not as expected."""
    faults = 0
    for expected, timeout, jobs, environment in [GROUPS[number] for number in groups]:
        begin, what = time.monotonic(), "as expected"
        try:
            with short_folder() as folder:
                fought(Place(folder, **environment), expected, timeout, jobs)
        except AssertionError as error:
            what, faults = f"NOT as expected: {error}", faults + 1
        where = " within reach of the run folder" if environment else ""
        print(f"{len(expected)} methods{where}, {time.monotonic() - begin:.0f} s: {what}", flush=True)
    count = sum(len(GROUPS[number][0]) for number in groups)
    print(f"{count} methods, {faults} of {len(groups)} groups not as expected")
    return faults


if __name__ == "__main__":
    sys.exit(main([int(number) for number in sys.argv[1:]] or range(len(GROUPS))))
