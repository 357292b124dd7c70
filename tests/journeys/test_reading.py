"""How often the maps of a run are read: the time of a run of ten thousand cells hangs on it."""

import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from places import METHODS

import matbench
from matbench.cli import main
from matbench.runs import store

SMALL = "synthetic/box[size=96x72]"


NAMES = ["flat", "noise", "misshapen", "flat[value=2]"]  # one of them fails


DICE = """
import numpy as np
from matbench import Estimate

class Rolls:
    def solve(self, scene, context):
        return Estimate({scene.ref: np.random.default_rng().random(scene.views.shape[1:3], np.float32)})
"""


_opened: Counter[str] | None = None


def _hear(event: str, arguments: tuple[Any, ...]) -> None:
    if event == "open" and _opened is not None and str(arguments[0]).endswith("disparity.npz"):
        _opened[Path(str(arguments[0])).parent.name] += 1


sys.addaudithook(_hear)  # it hears every way to open a file, and stays as long as the process


class Reads:
    """What was read since the last look: key of a cell -> how often its maps were opened, and how often hashed."""

    def __init__(self) -> None:
        self.hashed = 0

    def take(self) -> tuple[dict[str, int], int]:
        assert _opened is not None
        found = dict(_opened), self.hashed
        _opened.clear()
        self.hashed = 0
        return found


@pytest.fixture
def reads(monkeypatch: pytest.MonkeyPatch) -> Iterator[Reads]:
    global _opened
    found, original = Reads(), store.maps_digest

    def hashed(maps: Any) -> str:
        found.hashed += 1
        return original(maps)

    monkeypatch.setattr(store, "maps_digest", hashed)
    _opened = Counter()
    yield found
    _opened = None


def _type(*line: object) -> int:
    with pytest.raises(SystemExit) as stop:
        main([str(token) for token in line])
    return int(stop.value.code or 0)


def _answered(run: Path) -> list[str]:
    cells = pd.read_csv(run / "cells.csv", keep_default_na=False)
    return sorted(cells.cell[cells.status == "ok"])


def _written(run: Path) -> dict[str, tuple[int, bytes]]:
    names = ("results.csv", "cells.csv", "scores.json", "report.html")
    return {name: ((run / name).stat().st_ino, (run / name).read_bytes()) for name in names}


def test_a_journey_of_one_run_reads_each_map_as_seldom_as_can_be(tmp_path: Path, reads: Reads) -> None:
    run, good = tmp_path / "run", ["flat", "noise", "flat[value=2]"]
    line = ["compare", "-s", SMALL, "--plugin", METHODS, "--out", run, "-a", *good]

    def read(times: int) -> tuple[dict[str, int], int]:
        return dict.fromkeys(_answered(run), times), times * len(_answered(run))

    assert _type(*line) == 0
    assert len(_answered(run)) == 3
    assert reads.take() == read(2), "once for all tables, once for the page"
    before = _written(run)
    assert _type(*line) == 0
    assert reads.take() == read(1), "is it whole? what was made of it stays as it is"
    assert _written(run) == before
    assert _type(*line, "--dry-run") == 0
    assert reads.take() == read(1)
    assert _type("score", run) == 0
    assert reads.take() == read(2), "all is made anew"
    assert {name: content for name, (_, content) in _written(run).items()} == {n: c for n, (_, c) in before.items()}
    assert _type("report", run, "--format", "csv", "--out", tmp_path / "table.csv") == 0
    assert _type("status", run) == 0
    assert reads.take() == ({}, 0), "tables and facts say it all"
    assert _type("export", run, "--out", tmp_path / "run.zip") == 0
    opened, hashed = reads.take()
    assert hashed == 3
    assert max(opened.values()) <= 3, "is it whole, its digest for the manifest, its bytes"
    assert _type("figure", "maps", run) == 0
    assert reads.take() == read(1)


def test_what_is_left_of_a_run_costs_the_rest_one_reading_more(tmp_path: Path, reads: Reads) -> None:
    matbench.compare(NAMES, SMALL, out=tmp_path / "run", plugin=METHODS)
    reads.take()
    matbench.compare(NAMES, SMALL, out=tmp_path / "run", plugin=METHODS)  # the one that failed is tried again
    opened, _ = reads.take()
    assert opened == dict.fromkeys(_answered(tmp_path / "run"), 3), "is it whole, its scores, its picture"


def test_repeats_are_read_once_and_those_that_differ_are_told_again(
    tmp_path: Path, reads: Reads, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "dice.py").write_text(DICE)
    line = ["compare", "-a", "rolls", "-s", SMALL, "--plugin", tmp_path / "dice.py", "--out", tmp_path / "run"]
    assert _type(*line, "--repeats", "3") == 0
    opened, _ = reads.take()
    assert sorted(opened.values()) == [1, 1, 2], "no page shows repeats"
    first = capsys.readouterr().out
    assert _type(*line, "--repeats", "3") == 0
    assert sorted(reads.take()[0].values()) == [1, 1, 1]
    (told,) = [one for one in first.splitlines() if "3 solves gave 3 answers" in one]
    assert told in capsys.readouterr().out
