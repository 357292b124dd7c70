"""Tables that are as they were made, and those that are not."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from attrs import evolve
from numpy.typing import NDArray
from places import METHODS

from matbench import comparison
from matbench.plans.settings import Settings
from matbench.results import freshness

SMALL = "synthetic/box[size=96x72]"


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


def test_tables_say_how_they_were_made(tmp_path: Path) -> None:
    ready = comparison.prepare(["flat", "noise"], "synthetic/box[size=48x36]", out=tmp_path / "run", plugin=METHODS)
    assert "nothing says" in freshness.fault(ready.plan, ready.store)
    ready.run()
    ready.tables()
    assert freshness.fault(ready.plan, ready.store) == ""
    path = ready.folder / "scores.json"
    made = json.loads(path.read_text())
    path.write_text(json.dumps({**made, "scorer": "0" * 16}))
    assert "another scorer (0000000000000000" in freshness.fault(ready.plan, ready.store)
    path.write_text(json.dumps(made))
    ready.store.remove(ready.plan.cells[0])
    assert freshness.fault(ready.plan, ready.store) == "cells were computed since"
