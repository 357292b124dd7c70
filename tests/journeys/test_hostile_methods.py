"""Methods that fight those who watch them: some of each kind; `proofs/hostile_methods.py` has all of them."""

import signal
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from hostile import SLEEPS
from proofs import hostile_methods
from proofs.hostile_methods import DRAFTS, FAIR, FIGHTS, LEFT, WAITS, Place, fought
from waiting import wait_until

from matbench.solving.confinement import UNCONFINED

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="methods are watched by Linux's means")


@pytest.fixture
def folder() -> Iterator[Path]:
    with hostile_methods.short_folder() as place:
        yield place


def test_who_fights_costs_its_own_cell_alone_and_leaves_nothing(folder: Path) -> None:
    some = {name: FIGHTS[name] for name in ("kills_keeper[clean=true]", "kills_server", "multiplies", "stops_server")}
    some["stops_keeper"] = WAITS["stops_keeper"]
    for name in ("answers[what=pipe]", "answers[what=sparse]", "spoils", "spoils[file=views.npz what=pipe]"):
        some[name] = LEFT[name]
    fought(Place(folder), some)


def test_what_lies_in_the_folder_of_a_cell_may_be_anything(folder: Path) -> None:
    names = (
        "drafts[what=victim]",
        "drafts[file=cell.json what=pipe]",
        "drafts[what=deep]",
        "drafts[file=. what=victim]",
    )
    fought(Place(folder, **{UNCONFINED: "1"}), {name: DRAFTS[name] for name in names})


def test_what_a_killed_run_has_left_is_ended_by_the_next_start_of_it(folder: Path) -> None:
    place = Place(folder)
    with place.start("kills_run", "fair", timeout=60, jobs=1) as run:
        run.communicate(timeout=300)
        assert run.returncode == -signal.SIGKILL
    wait_until(lambda: any(SLEEPS in one for one in place.left()), what="its daemon")
    assert list(place.temporary.glob("matbench-held-*"))
    fought(place, {"kills_run": FAIR})
