"""A method does what it does in a script: it starts processes, by whatever means, and these find its file's classes."""

from pathlib import Path

import pytest
from places import AT_HOME

from matbench import comparison
from matbench.plans.plan import methods
from matbench.plans.settings import Settings
from matbench.solving import method_check

SMALL = "synthetic/box[size=96x72]"
EVERY = [
    "pool[start=fork,forkserver]",
    "executor[start=fork,spawn]",
    "queued[start=forkserver]",
    "default",
    "loader",
    "program",
    "itself",
]


@pytest.mark.parametrize(
    ("isolation", "every"), [("process", EVERY), ("shared", ["pool[start=forkserver,spawn]", "executor"])]
)
def test_workers_find_the_classes_and_functions_of_a_plug_in(tmp_path: Path, isolation: str, every: list[str]) -> None:
    settings = Settings(timeout=150, isolation=isolation)
    ready = comparison.prepare(every, SMALL, out=tmp_path / "run", plugin=AT_HOME, settings=settings)
    ready.run()
    for cell in ready.plan.cells:
        outcome = ready.store.outcome(cell)
        log = (ready.store.cell(cell) / "log.txt").read_text()
        assert outcome is not None
        assert (outcome.status, log) == ("ok", ""), (str(cell), outcome.reason, log[-2000:])
        (answer,) = ready.store.disparity(cell).values()
        assert (answer == 3).all(), str(cell)


def test_the_memory_of_workers_counts_whoever_starts_them(tmp_path: Path) -> None:
    settings = Settings(timeout=150, memory=400)
    ready = comparison.prepare("counted", SMALL, out=tmp_path / "run", plugin=AT_HOME, settings=settings)
    ready.run()
    (outcome,) = (ready.store.outcome(cell) for cell in ready.plan.cells)
    assert outcome is not None
    assert (outcome.status, "400 MiB are its limit" in outcome.reason) == ("out-of-memory", True), outcome.reason


def test_a_method_with_workers_is_checked(smaller: object) -> None:
    (method,) = methods("pool", [AT_HOME])
    found = {one.check: one for one in method_check.check(method, [AT_HOME], timeout=150)}
    assert {name: found[name].verdict for name in ("answers", "views", "seed", "quiet")} == dict.fromkeys(
        ("answers", "views", "seed", "quiet"), "pass"
    ), found
