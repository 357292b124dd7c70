"""The same plan on a Dask cluster of several processes, one of which dies and one of which comes late."""

import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import accumulate
from pathlib import Path

import psutil
import pytest
from attrs import evolve
from machines import Machines
from places import METHODS, PROGRAMS, ROUGH
from scene_files import Layers, pfm_bytes, write_png
from tools import need
from waiting import wait_until

from matbench import comparison
from matbench.errors import UserError
from matbench.plans.settings import Settings
from matbench.runs import provenance
from matbench.solving import cluster, run

MATCHER = PROGRAMS / "block_matcher.py"


SMALL = "synthetic/box[size=96x72]"


def prepare(folder: Path, *algorithms: str, scene: str = SMALL, **settings: object) -> comparison.Comparison:
    return comparison.prepare(
        list(algorithms), scene, out=folder, plugin=[ROUGH, METHODS], settings=Settings(**settings)
    )


@contextmanager
def meanwhile(act: Callable[[], None]) -> Iterator[None]:
    failed: list[BaseException] = []

    def guarded() -> None:
        try:
            act()
        except BaseException as error:
            failed.append(error)

    thread = threading.Thread(target=guarded)
    thread.start()
    yield
    thread.join()
    assert not failed, failed


def test_a_worker_that_dies_and_one_that_comes_late(
    machines: Machines, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for _ in range(2):
        machines.add()  # with a nanny: the worker is a daemon
    wait_until(lambda: len(machines.pids()) == 2)
    waiting = [f"tells[wait=2 mark={mark}]" for mark in range(6)]
    ready = prepare(tmp_path / "run", *waiting, "segfaults", "loops", dask=machines.address, timeout=8)
    addresses = machines.pids()
    told: list[tuple[str, str]] = []
    first_is_done = threading.Event()
    ended: list[psutil.Process] = []

    def listen(event: run.Event, cell: run.Cell, outcome: run.Outcome | None) -> None:
        told.append((event, cell.key))
        if event == "done":
            first_is_done.set()

    def disturb() -> None:
        assert first_is_done.wait(240)
        victim = psutil.Process(next(iter(addresses.values())))
        wait_until(lambda: len(victim.children(recursive=True)) >= 3)  # a server, a keeper, a method
        ended.extend(victim.children(recursive=True))
        victim.kill()
        machines.add("--no-nanny")

    with meanwhile(disturb):
        ready.run(listen)
    assert not psutil.wait_procs(ended, timeout=300)[1], "what the dead worker had started"
    cells = ready.tables().cells
    by_name = cells.set_index("algorithm")
    assert (by_name.status["tells"] == "ok").all()
    assert "SIGSEGV" in by_name.reason["segfaults"]
    assert by_name.reason["loops"].startswith("stopped after 8 s (log: cells/")
    assert not cells.alone.any()
    assert sorted(told) == sorted([(event, cell.key) for event in ("start", "done") for cell in ready.plan.cells])
    assert [event for event, _ in told].index("done") <= 4, "two workers, and at most one cell more of each"
    running = list(accumulate(1 if event == "start" else -1 for event, _ in told))
    # a worker begins its next cell while the end of its last one is on its way to us
    assert max(running) <= 7 < len(cells), "three workers, and what the dead one had begun; others wait"
    assert not list((tmp_path / "run" / "cells").glob(".*"))

    program = tmp_path / "matcher"
    program.write_text(f"#!{sys.executable}\n{MATCHER.read_text()}")
    program.chmod(0o755)
    names = "flat", "noise", f"command[program={program}]"
    here = prepare(tmp_path / "here", *names)
    there = prepare(tmp_path / "there", *names, dask=machines.address)
    for one in (here, there):
        one.run()
        one.tables()
        outcomes = [one.store.outcome(cell) for cell in one.plan.cells]
        assert {(o.status, o.ran_on["commit"]) for o in outcomes if o} == {("ok", provenance.commit())}
    assert (there.folder / "results.csv").read_bytes() == (here.folder / "results.csv").read_bytes()

    # what the workers have not, or have otherwise, is refused
    layers = Layers()
    (tmp_path / "mine").mkdir()
    for number in range(2):
        write_png(tmp_path / "mine" / f"{number}.png", layers.view(number))
    (tmp_path / "mine" / "truth.pfm").write_bytes(pfm_bytes(layers.truth()))
    (tmp_path / "mine" / "scene.toml").write_text(
        'views = ["0.png", "1.png"]\ndisparities = [-2, 3]\n[truth."0.png"]\nfile = "truth.pfm"\n'
    )
    lacking = prepare(tmp_path / "lacking", "flat", scene="./mine", dask=machines.address)
    lacking.run()
    (why,) = lacking.tables().cells.reason
    assert "the worker has not ./mine: " in why
    cell = evolve(there.plan.cells[0], key="0" * 16, method=evolve(there.plan.cells[0].method, code="0" * 64))
    other = evolve(there, plan=evolve(there.plan, cells=(cell,)))
    other.run()
    assert "the worker has other code of flat" in other.tables().cells.reason[0]

    # Ctrl-C ends what the workers do
    long = prepare(tmp_path / "long", "flat", "tells[wait=3600]", "tells[wait=3599]", dask=machines.address)

    def stop(event: run.Event, *_: object) -> None:
        if event == "done":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        long.run(stop)

    def busy() -> list[psutil.Process]:
        return [p for pid in machines.pids().values() for p in psutil.Process(pid).children(True) if _works(p)]

    wait_until(lambda: not busy(), 30)


def _works(process: psutil.Process) -> bool:
    """Is it the process of a cell? Its parent is a keeper, whose parent is the server, below the worker."""
    try:
        return len(process.parents()) > 3 and "forkserver" in " ".join(process.parents()[1].cmdline())
    except psutil.Error:
        return False


def test_a_cluster_of_this_machine(tmp_path: Path) -> None:
    need("dask")
    (tmp_path / "mine" / "tools").mkdir(parents=True)
    (tmp_path / "mine" / "tools" / "level.py").write_text("LEVEL = 2.5\n")
    (tmp_path / "mine" / "helped.py").write_text(
        "import numpy as np\nfrom matbench import Estimate\n\nclass Helped:\n    def solve(self, scene, context):\n"
        "        from tools.level import LEVEL\n"
        "        return Estimate({scene.ref: np.full((scene.height, scene.width), LEVEL, np.float32)})\n"
    )
    line = [sys.executable, "-m", "matbench", "compare", "-a", "flat", "exits", "helped", "-s", SMALL, "--out", "run"]
    line += ["--plugin", str(METHODS), "--plugin", "mine/helped.py", "--dask", "local", "--jobs", "2"]
    done = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, timeout=240)
    assert done.returncode == 1, done.stderr
    assert "crashed  exits on" in done.stdout
    assert "ok  flat on" in done.stdout
    assert "ok  helped on" in done.stdout, "what it imports from its folder went with it"
    assert "Traceback" not in done.stderr


def test_a_cluster_that_cannot_be_had(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ready = prepare(tmp_path / "run", "flat", dask="tcp://127.0.0.1:1")
    monkeypatch.setattr(cluster, "_PATIENCE", "1s")
    with pytest.raises(UserError, match=r"'tcp://127.0.0.1:1' cannot be reached: write tcp://HOST:PORT"):
        ready.run()
    with pytest.raises(UserError, match="'nonsense://host:1' cannot be reached"):
        evolve(ready, settings=Settings(dask="nonsense://host:1")).run()
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(UserError, match=r"pip install 'matbench-stereo\[cluster\]'"):
        ready.run()
