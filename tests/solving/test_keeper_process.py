"""Whatever a method does to its process costs its cell alone; limits are enforced from outside."""

import re
from pathlib import Path

import psutil
import pytest
from misbehaviour import EXPECTED, run


def below(pid: int | None = None) -> set[int]:
    """Processes below this one whose end is not merely unnoticed."""
    found = psutil.Process(pid).children(recursive=True)
    return {p.pid for p in found if p.is_running() and p.status() != psutil.STATUS_ZOMBIE}


@pytest.mark.parametrize("isolation", ["process", "shared"])
def test_whatever_a_method_does_costs_its_cell_alone(tmp_path: Path, isolation: str) -> None:
    names = [name for name in EXPECTED if name not in ("orphans", "loops")]
    found = run(tmp_path / "run", *names, timeout=120, memory=400, isolation=isolation)
    for name in names:
        status, reason, printed = EXPECTED[name]
        assert found.status[name] == status, (name, found.reason[name], found.log[name][-2000:])
        assert reason in found.reason[name]
        assert printed in found.log[name], (name, found.log[name][-2000:])
    assert len(found.log["chatters"]) < 200_000
    assert re.search(r"\d+ bytes left out", found.log["chatters"])
    assert "line 31" in found.log["chatters"]
    assert not found.log["flat"]
    assert {"sleep"}.isdisjoint(psutil.Process(pid).name() for pid in below()), "what methods leave behind is ended"


def test_an_endless_loop_is_stopped(tmp_path: Path) -> None:
    found = run(tmp_path / "run", "loops", timeout=5)
    status, reason, printed = EXPECTED["loops"]
    log = f"(log: cells/{found.cell['loops']}/log.txt)"
    assert (found.status["loops"], found.reason["loops"]) == (status, f"{reason} {log}")
    assert printed in found.log["loops"]
