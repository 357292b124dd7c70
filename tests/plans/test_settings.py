"""Settings of a run: read as people write them, and shared out to the cells that run at once."""

import pytest

from matbench.errors import UserError
from matbench.plans import limits
from matbench.plans.settings import Settings


def test_texts_become_numbers() -> None:
    found = Settings(timeout="600", memory="1.5G", jobs="3", threads="2", isolation="shared")  # type: ignore[arg-type]
    assert (found.timeout, found.memory, found.jobs, found.threads) == (600.0, 1536, 3, 2)
    assert Settings(timeout="none").timeout is None  # type: ignore[arg-type]


def test_cores_and_memory_are_shared_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "cores", lambda: 8)
    monkeypatch.setattr(limits, "room", lambda: 9000)
    assert (Settings().threads_each(), Settings().memory_each()) == (8, 9000)
    assert (Settings(jobs=3).threads_each(), Settings(jobs=3).memory_each()) == (2, 3000)
    assert Settings(jobs=20).threads_each() == 1, "at least one"
    asked = Settings(jobs=3, threads=5, memory=100)
    assert (asked.threads_each(), asked.memory_each()) == (5, 100), "what is asked for is given"


@pytest.mark.parametrize(
    ("wrong", "said"),
    [({"timeout": 0}, "timeout 0"), ({"jobs": 0}, "jobs 0"), ({"memory": "x"}, "memory 'x'"), ({"threads": -1}, "-1")],
)
def test_what_makes_no_sense_is_refused(wrong: dict[str, object], said: str) -> None:
    with pytest.raises(UserError, match=said):
        Settings(**wrong)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="only"):
        Settings(only="some")  # type: ignore[arg-type]
