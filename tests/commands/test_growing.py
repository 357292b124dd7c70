"""`--until decided`: it stops when two methods are told apart, when time is up, or when there are no more scenes."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from attrs import evolve

from matbench import comparison
from matbench.commands import growing
from matbench.commands.options import Options
from matbench.comparison import Growth
from matbench.errors import UserError
from matbench.plans import plugins
from matbench.plans.settings import Settings
from matbench.rescoring import open_run
from matbench.results import freshness
from matbench.results.deciding import Ended
from matbench.runs.store import Store
from matbench.runs.todo import Todo

OWN = '''
import time

import numpy as np

from matbench import Estimate, Listing, Range, Scene


class Many:
    """Scenes whose pixels tell their disparity."""

    def listings(self, root):
        return [Listing(f"s{k}", 2, {}, True) for k in range(34)]

    def load(self, name, options, root):
        draw = np.random.default_rng(int(name[1:]))
        truth = draw.integers(0, 5, (16, 24)).astype(np.float32)
        views = np.repeat(truth[None, :, :, None], 2, axis=0).repeat(3, axis=3).astype(np.uint8)
        regions = {"all": np.ones((16, 24), bool)}
        return Scene(f"many/{name}", views, ("a", "b"), 0, Range(0, 5), {0: truth}, 2, regions)


class Guess:
    """Reads most pixels, and guesses the rest."""

    def __init__(self, rate: float = 0.2, number: int = 0, wait: float = 0.0) -> None:
        self.rate, self.number, self.wait = rate, number, wait

    def solve(self, scene, context):
        time.sleep(self.wait)
        told = scene.views[0, :, :, 0]
        draw = np.random.default_rng([self.number, int(told.astype(int).ravel() @ np.arange(told.size))])
        wrong = draw.random(told.shape) < self.rate * draw.lognormal(0, 0.3)
        return Estimate({0: np.where(wrong, (told + 2) % 5, told).astype(np.float32)})
'''


@pytest.fixture
def place(tmp_path: Path) -> Path:
    (tmp_path / "own.py").write_text(OWN)
    return tmp_path


def grow(place: Path, first: str, second: str, *more: str, scenes: str = "many/*") -> dict[str, Any]:
    line = [sys.executable, "-m", "matbench", "compare", "--plugin", "own.py", "-s", scenes, "-a", first, "-a", second]
    line += ["--until", "decided", "--isolation", "shared", "--out", "run", "--json", *more]
    done = subprocess.run(line, cwd=place, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    return found | {"said": done.stderr}


def test_it_stops_as_soon_as_two_methods_are_told_apart_and_goes_on_where_it_was(place: Path) -> None:
    good, bad = "guess", "guess[rate=0.4]"
    found = grow(place, good, bad)
    told = found["decision"]
    assert (told["first"], told["second"], told["scenes"], told["ended"]) == (good, bad, 32, "decided")
    assert told["verdict"] == "better"
    assert told["interval"][1] < 0
    assert found["cells"] == {"ok": 64}
    plan = json.loads((place / "run" / "plan.json").read_text())
    assert len(plan["cells"]) == 64
    assert len(plan["among"]) == 34
    page = (place / "run" / "report.html").read_text()
    assert "guess against guess[rate=0.4] after 32 scenes" in page
    scored = subprocess.run(
        [sys.executable, "-m", "matbench", "score", "run", "--plugin", "own.py"],
        cwd=place,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert scored.returncode == 0, scored.stderr
    assert "the scores are what they were" in scored.stdout
    assert (place / "run" / "report.html").read_text() == page, "with its decision"
    _is_decided_from_tables(place, told)
    again = grow(place, good, bad)
    assert again["decision"] == told
    assert "64 of 64 cells are done already" in again["said"]


def _is_decided_from_tables(place: Path, told: dict[str, Any]) -> None:
    """Only what the tables bear out is said again, whatever a run folder claims."""
    ready, _ = open_run(place / "run", plugin=[place / "own.py"])
    scored, made = ready.tables(), freshness.made(ready.store)
    assert made is not None
    assert made.ended is None, "tables that are made anew have no page yet"
    ended = Ended(told["first"], told["second"], told["metric"], 0, "decided")
    with plugins.using(ready.files):
        found = growing.decided_again(ready, scored, ended)
        assert found is not None
        assert found.facts == told
        for other in (
            None,
            evolve(ended, first="nobody"),
            evolve(ended, metric="no_metric"),
            evolve(ended, why="budget"),
            evolve(ended, number=None),
            evolve(ended, number=-1),
            evolve(ended, number=99),
            evolve(ended, number=1),  # at all 34 scenes, two of which are not in the run
        ):
            assert growing.decided_again(ready, scored, other) is None, other
        early = growing.decided_again(ready, scored, evolve(ended, number=None, why="budget"))
        assert early is not None
        assert (early.scenes, early.verdict, early.why) == (0, "undecided", "budget")


def test_equal_methods_go_through_all_scenes(place: Path) -> None:
    found = grow(place, "guess", "guess[number=1]")
    assert found["decision"] | {"difference": 0, "interval": 0} == {
        "first": "guess",
        "second": "guess[number=1]",
        "metric": "total_bad_1",
        "region": "all",
        "scenes": 34,
        "difference": 0,
        "interval": 0,
        "verdict": "undecided",
        "ended": "scenes",
    }
    assert "32 scenes: total_bad_1 in all" in found["said"]
    assert "there are no more scenes" in found["said"]


def test_a_spent_budget_is_no_failure_and_the_same_command_goes_on(place: Path) -> None:
    found = grow(place, "guess", "guess[number=1]", "--budget", "0.01s", scenes="many/s?")
    assert found["decision"]["ended"] == "budget"
    assert found["decision"]["interval"] is None
    assert found["cells"] == {"interrupted": 20}
    assert "the budget is spent, the same command goes on from here" in found["said"]
    rest = grow(place, "guess", "guess[number=1]", scenes="many/s?")
    assert rest["decision"]["ended"] == "scenes"
    assert rest["cells"] == {"ok": 20}


def test_scenes_that_some_method_has_not_done_are_left_for_the_next_time(place: Path) -> None:
    names = [f"many/s{k}" for k in range(8)]
    given = {"settings": Settings(isolation="shared"), "out": place / "run", "plugin": place / "own.py"}
    ready = comparison.prepare(["guess", "guess[number=1]"], names[:4], growth=Growth(names), **given)
    ready.run(todo=Todo(ready.plan.cells[:5]))
    left = growing.complete(ready)
    assert [cell.scene for cell in left.plan.cells] == ["many/s0", "many/s0", "many/s1", "many/s1"]
    assert set(left.scenes) == {"many/s0", "many/s1"}
    assert Store(place / "run").plan() == left.plan
    assert not left.store.stale(left.plan), "what is done of a scene to come is kept"
    again = comparison.prepare(["guess", "guess[number=1]"], names[:4], growth=Growth(names, left.scenes), **given)
    assert len(again.pending().cells) == 3


def test_what_cannot_be_decided_is_refused() -> None:
    with pytest.raises(UserError, match="adds scenes, and 5 decide nothing"):
        growing.work(None, [f"many/s{k}" for k in range(5)], Options(until="decided"))  # type: ignore[arg-type]
    with pytest.raises(UserError, match="adds scenes, and 1 decide nothing"):
        growing.work(None, [f"many/s[noise={k}]" for k in range(9)], Options(until="decided"))  # type: ignore[arg-type]
    with pytest.raises(UserError, match="--budget 5m ends what --until decided goes on with"):
        assert Options(budget="5m").grows
    with pytest.raises(UserError, match="budget 'soon' is no time such as 90s"):
        growing.work(None, ["a"] * 20, Options(until="decided", budget="soon"))  # type: ignore[arg-type]
    assert not Options().grows
