"""How often the maps of a run are read: time and memory of a run of ten thousand cells hang on it."""

import sys
import weakref
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from attrs import evolve
from numpy.typing import NDArray
from places import METHODS

import matbench
from matbench import comparison
from matbench.cli import main
from matbench.plans.settings import Settings
from matbench.results import freshness, scores
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


def test_tables_that_are_kept_are_those_that_were_made(tmp_path: Path) -> None:
    """Types and bits, so that nobody can tell whether they were computed or read."""
    ready = comparison.prepare(
        ["flat", "noise", "declines", "solid"],
        [SMALL, "synthetic/box[predict=right size=96x72]"],
        out=tmp_path / "run",
        plugin=METHODS,
        settings=Settings(volumes=True),
        command="x",
    )
    ready.run()
    made = ready.tables()
    assert ready.kept(ready.pending()) is None, "there is no page yet"
    ready.report(made)
    kept = ready.kept(ready.pending())
    assert kept is not None
    for name in ("results", "cells", "reliability"):
        pd.testing.assert_frame_equal(getattr(kept, name), getattr(made, name), check_exact=True)
    assert kept.outcomes == made.outcomes


@pytest.mark.parametrize("change", ["map", "facts", "table", "page", "volume", "truth", "scorer", "drawing", "words"])
def test_whatever_has_changed_is_made_anew(tmp_path: Path, change: str, monkeypatch: pytest.MonkeyPatch) -> None:
    run = tmp_path / "run"
    ready = comparison.prepare(
        ["flat", "solid"], SMALL, out=run, plugin=METHODS, settings=Settings(volumes=True), command="x"
    )
    ready.run()
    ready.report(ready.tables())
    assert ready.kept(ready.pending()) is not None
    flat, solid = (ready.store.cell(cell) for cell in ready.plan.cells)
    ready = evolve(ready, settings=Settings())
    if change == "map":
        arrays = dict(np.load(flat / "disparity.npz"))
        np.savez_compressed(flat / "disparity.npz", **{name: values + 1 for name, values in arrays.items()})
        assert [cell.method.algorithm for cell in ready.pending().cells] == ["flat"], "it is computed anew"
    elif change == "facts":  # killed between cells and tables, all of which were computed again
        text = (flat / "cell.json").read_text()
        (flat / "cell.json").write_text(text.replace('"warmup_seconds": ', '"warmup_seconds": 1'))
        assert (flat / "cell.json").read_text() != text
    elif change == "table":
        (run / "cells.csv").write_text((run / "cells.csv").read_text() + "\n")
    elif change == "page":
        (run / "report.html").unlink()
    elif change == "volume":
        (solid / "volume.npz").unlink()
    elif change == "truth":
        scene = ready.scenes[SMALL]
        truth = {view: values + np.float32(1) for view, values in scene.truth.items()}
        ready = evolve(ready, scenes={SMALL: evolve(scene, truth=truth)})
    elif change == "scorer":
        monkeypatch.setattr(freshness, "digest", lambda: "0" * 16)
    elif change == "drawing":
        monkeypatch.setattr(freshness, "_drawing", lambda: "0" * 16)
    else:
        ready = evolve(ready, command="y")
    assert ready.kept(ready.pending()) is None


def test_a_map_that_changes_after_it_was_scored_is_not_drawn(tmp_path: Path) -> None:
    ready = comparison.prepare(["flat", "noise"], SMALL, out=tmp_path / "run", plugin=METHODS, command="x")
    ready.run()
    made = ready.tables()
    first, second = (ready.store.cell(cell) for cell in ready.plan.cells)
    (first / "disparity.npz").write_bytes((second / "disparity.npz").read_bytes())
    drawn: list[NDArray[np.float32] | None] = []

    def look(path: Path, report: Any) -> None:
        drawn.extend(report.disparity(c.method.algorithm, c.method.changed, c.scene, c.seed) for c in ready.plan.cells)
        path.touch()

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("matbench.reports.page.write_page", look)
        ready.report(made)
    assert drawn[0] is None
    assert drawn[1] is not None
    assert ready.kept(ready.pending()) is None
    assert [cell.method.algorithm for cell in ready.pending().cells] == ["flat"]


def test_no_more_maps_are_held_than_two_however_many_cells_there_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ready = comparison.prepare("noise", SMALL, out=tmp_path / "run", seed=range(3), plugin=METHODS, repeats=3)
    ready.run()
    alive: weakref.WeakSet[Any] = weakref.WeakSet()
    most = 0
    original = store.Store.read

    def read(self: store.Store, cell: Any) -> store.Solved:
        nonlocal most
        found = original(self, cell)
        alive.add(found)
        most = max(most, len(alive))
        return found

    monkeypatch.setattr(store.Store, "read", read)
    assert len(scores.tables(ready.plan, ready.store, ready.scenes).cells) == 3
    assert most <= 3, "the scored one, a repeat, and the next one as it is read"
