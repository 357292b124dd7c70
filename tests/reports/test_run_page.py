"""The page of a run: what it is made from, and that it is known when it is old."""

from pathlib import Path

import pytest
from attrs import evolve
from places import METHODS

from matbench import comparison
from matbench.plans.record_option import MOST_ROWS, RecordOption
from matbench.plans.settings import Settings
from matbench.prepared import Comparison
from matbench.reports import page
from matbench.reports.page import Report
from matbench.results import freshness

TINY = "synthetic/box[size=48x36]"


@pytest.fixture
def ready(tmp_path: Path) -> Comparison:
    made = comparison.prepare("flat", TINY, plugin=[METHODS], out=tmp_path / "run")
    made.run()
    return made


def drawn(ready: Comparison, monkeypatch: pytest.MonkeyPatch) -> Report:
    """What is given to whoever draws the page."""
    given: list[Report] = []
    monkeypatch.setattr(page, "write_page", lambda path, report: given.append(report))
    ready.report(ready.tables())
    return given[0]


def test_it_is_old_as_soon_as_one_of_its_words_is_another(ready: Comparison) -> None:
    assert ready.page.digest(is_ablation=False) == "", "there is none"
    ready.report(ready.tables())
    now = ready.page.digest(is_ablation=False)
    made = freshness.made(ready.store)
    assert made is not None
    assert made.page == now
    others = [
        ready.page.digest(is_ablation=True),
        evolve(ready, decision="decided").page.digest(is_ablation=False),
        evolve(ready, command="matbench compare").page.digest(is_ablation=False),
        evolve(ready, settings=evolve(ready.settings, published=True)).page.digest(is_ablation=False),
        evolve(ready, settings=evolve(ready.settings, metrics=("bad_1",))).page.digest(is_ablation=False),
        evolve(ready, settings=evolve(ready.settings, record=RecordOption(rows=[7]))).page.digest(is_ablation=False),
    ]
    assert len({now, *others}) == 1 + len(others)
    (ready.folder / "report.html").write_text("another page")
    assert ready.page.digest(is_ablation=False) != now


def test_maps_are_shown_that_were_scored_and_no_others(ready: Comparison, monkeypatch: pytest.MonkeyPatch) -> None:
    shown = drawn(ready, monkeypatch)
    (cell,) = ready.plan.cells
    names = *cell.method.names, cell.scene, cell.seed
    assert shown.maps(*names) is not None
    assert shown.volumes is not None
    assert shown.volumes(*names) is None, "none was kept"
    tables = ready.tables()
    outcome = tables.outcomes[cell.key]
    stale = evolve(tables, outcomes={cell.key: evolve(outcome, seconds=outcome.seconds + 1)})
    given: list[Report] = []
    monkeypatch.setattr(page, "write_page", lambda path, report: given.append(report))
    ready.report(stale)
    assert given[0].maps(*names) is None, "it was solved again since"


def test_it_ranks_by_what_is_better_when_less(ready: Comparison, monkeypatch: pytest.MonkeyPatch) -> None:
    assert drawn(ready, monkeypatch).metric == "total_bad_1"
    for asked, ranked in (("bad_2", "bad_2"), ("prediction_psnr", "total_bad_1")):
        other = evolve(ready, settings=Settings(metrics=(asked, "avg")))
        assert drawn(other, monkeypatch).metric == ranked


def test_rows_are_those_asked_for_and_those_recorded(ready: Comparison, monkeypatch: pytest.MonkeyPatch) -> None:
    found = evolve(ready, settings=Settings(record=RecordOption(rows=[9, 3])))
    assert drawn(found, monkeypatch).rows == (3, 9)
    tables = ready.tables()
    recorded = {
        key: evolve(outcome, recorded=RecordOption(rows=[1, 3, *range(20, 20 + MOST_ROWS - 2)]))
        for key, outcome in tables.outcomes.items()
    }
    given: list[Report] = []
    monkeypatch.setattr(page, "write_page", lambda path, report: given.append(report))
    found.report(evolve(tables, outcomes=recorded))
    assert given[0].rows == tuple(sorted({1, 3, 9, *range(20, 20 + MOST_ROWS - 2)})[:MOST_ROWS])


def test_facts_say_what_the_cells_ran_on(ready: Comparison, monkeypatch: pytest.MonkeyPatch) -> None:
    facts = drawn(ready, monkeypatch).facts
    assert facts["seeds"] == "0"
    assert facts["scorer"] == freshness.digest()
    assert "ranges" not in facts
