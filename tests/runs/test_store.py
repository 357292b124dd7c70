"""Runs that are killed, starved and crowded, and go on as if nothing had been."""

import importlib
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
import psutil
import pytest
from attrs import evolve
from launcher import METHODS, SCENE, SEEDS
from places import LAUNCHER
from places import METHODS as BEHAVED
from scene_files import Layers, write_png

from matbench import comparison
from matbench.cli import main
from matbench.errors import UserError
from matbench.plans import plugins
from matbench.plans.settings import Settings
from matbench.rescoring import open_run
from matbench.results import freshness, scores
from matbench.results.status import prune, standing
from matbench.runs.lock import Work, locked
from matbench.runs.store import FolderLost
from matbench.runs.todo import explained

PATIENCE = 900
RAISES = "failed: ArithmeticError: the third digit is missing and more (mine.py:87)"

PLUGIN = """
import os
from pathlib import Path
import numpy as np
from matbench import Estimate

def tell(scene, what):
    if scene.height > 16 and "JOURNAL" in os.environ:  # the warm-up is on fewer rows
        with Path(os.environ["JOURNAL"]).open("a") as file:
            file.write(f"{what}\\n")

class Steady:
    def solve(self, scene, context):
        tell(scene, f"steady {context.seed}")
        return Estimate({scene.ref: np.full(scene.views.shape[1:3], 1 + context.seed / 16, np.float32)})

class Seeded:
    def solve(self, scene, context):
        tell(scene, f"seeded {context.seed}")
        values = np.random.default_rng(context.seed).random(scene.views.shape[1:3], np.float32)
        return Estimate({scene.ref: 3 * values})
"""


def wait_until(happens: Callable[[], object], what: str = "it") -> None:
    end = time.monotonic() + PATIENCE
    while not happens():
        assert time.monotonic() < end, f"{what} never happened"
        time.sleep(0.01)


def command(plugin: Path, out: Path, *more: str) -> list[str]:
    line = [sys.executable, "-m", "matbench", "compare", "--plugin", str(plugin), "--out", str(out), *more]
    return line if "-s" in more else [*line, "-s", SCENE]


def finished(run: Path) -> dict[str, tuple[int, int]]:
    """Key -> inode and time of every cell that is done; each must be whole."""
    out = {}
    for folder in (run / "cells").glob("[0-9a-f]*"):
        facts = json.loads((folder / "cell.json").read_text())
        assert {path.name for path in folder.iterdir()} <= {"cell.json", "disparity.npz", "log.txt"}
        if facts["outcome"]["status"] == "ok":
            with np.load(folder / "disparity.npz", allow_pickle=False) as maps:
                assert maps["view_2"].shape == (36, 48)
            stat = (folder / "cell.json").stat()
            out[facts["cell"]["key"]] = stat.st_ino, stat.st_mtime_ns
    return out


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[[Path], int]]:
    """Start a run of 50 cells in a folder, when the one before has ended; the process that works on it."""
    (tmp_path / "plugin.py").write_text(PLUGIN)
    (tmp_path / "journal").touch()
    environment = {**os.environ, "JOURNAL": str(tmp_path / "journal")}
    line = [sys.executable, str(LAUNCHER), str(tmp_path / "plugin.py")]
    with subprocess.Popen(line, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment) as launcher:
        assert launcher.stdin is not None
        assert launcher.stdout is not None
        launched = 0

        def begin(folder: Path) -> int:
            nonlocal launched
            assert launched == 0 or launcher.stdout.readline() == "ended\n"  # type: ignore[union-attr]
            launched += 1
            print(folder, file=launcher.stdin, flush=True)
            return int(launcher.stdout.readline())  # type: ignore[union-attr]

        yield begin
        launcher.stdin.close()


def test_killed_at_twenty_random_moments_it_ends_as_if_undisturbed(
    tmp_path: Path, start: Callable[[Path], int]
) -> None:
    chance = random.Random(5)  # noqa: S311
    run, journal = tmp_path / "run", tmp_path / "journal"
    done: dict[str, tuple[int, int]] = {}
    pid, kills, whole = start(run), 0, 0
    while kills < 20:
        if not _works(pid):
            pid = start(run)
        before = journal.stat().st_size
        if chance.random() < 0.8:  # else while it starts, or between two cells
            wait_until(partial(_has_moved, journal, before, pid), "a solve")
        time.sleep(chance.random() * 0.15)
        try:
            parent = psutil.Process(pid)
            children = parent.children(recursive=True)
        except psutil.NoSuchProcess:
            continue
        who = chance.choice(["all", "parent", "child", "child"])
        victims = [parent, *children] if who == "all" else [parent] if who == "parent" else children
        if who == "child" and victims:
            victims = [chance.choice(victims)]
        for victim in victims:
            _kill(victim)
        kills += bool(victims)
        if parent in victims:
            whole += 1
            wait_until(partial(_rests, pid), "its end")
            assert not psutil.wait_procs(children, timeout=PATIENCE)[1], "what it started outlived it"
            now = finished(run)
            assert done.items() <= now.items(), "a finished cell was lost or computed again"
            done = now
    assert whole >= 5
    assert len(done) < len(METHODS) * len(SEEDS), "the last kill came too late to matter"
    if _works(pid):
        _kill(psutil.Process(pid))
    wait_until(partial(_rests, pid), "its end")

    done = finished(run)
    line = command(tmp_path / "plugin.py", run, "-a", *METHODS, "--seed", *map(str, SEEDS))
    last = subprocess.run(line, capture_output=True, text=True, timeout=PATIENCE)
    assert last.returncode == 0, last.stdout + last.stderr
    now = finished(run)
    assert done.items() <= now.items()
    assert len(now) == 50
    assert not list((run / "cells").glob(".*"))
    assert {path.name for path in run.glob(".*")} == {".lock"}

    undisturbed = tmp_path / "undisturbed"
    wait_until(partial(_rests, start(undisturbed)), "the undisturbed run")
    again = comparison.prepare(METHODS, SCENE, out=undisturbed, seed=SEEDS, plugin=tmp_path / "plugin.py")
    assert not again.pending().cells
    again.tables()
    assert (run / "results.csv").read_bytes() == (undisturbed / "results.csv").read_bytes()


def _works(pid: int) -> bool:
    try:
        return psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def _rests(pid: int) -> bool:
    return not _works(pid)


def _has_moved(journal: Path, size: int, pid: int) -> bool:
    return journal.stat().st_size > size or _rests(pid)


def _kill(process: psutil.Process) -> None:
    with suppress(psutil.NoSuchProcess):
        process.send_signal(signal.SIGKILL)


def test_a_second_process_is_refused_and_the_first_can_be_watched(tmp_path: Path) -> None:
    run, plugin = tmp_path / "run", tmp_path / "plugin.py"
    endless = "        while scene.height > 16 and context.seed:\n            time.sleep(1)\n        values ="
    plugin.write_text("import time\n" + PLUGIN.replace("        values =", endless))
    line = command(plugin, run, "-a", "seeded", "--seed", "0", "1")
    first = subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
    try:
        wait_until(lambda: any((run / "cells").glob("[0-9a-f]*")), "the first cell")
        second = subprocess.run(line, capture_output=True, text=True, timeout=PATIENCE)
        assert second.returncode == 2
        assert second.stderr.count("\n") == 1
        assert f"is in use by process {first.pid} on " in second.stderr
        with pytest.raises(UserError, match="is in use by process"):
            prune(run)
        with pytest.raises(UserError, match="is in use by process"):
            open_run(run)[0].tables()
        wait_until(lambda: standing(run).running, "the endless cell")
        found = standing(run)
        assert found.work is not None
        assert (found.work.pid, found.counts, found.left) == (first.pid, {"ok": 1}, 1)
        assert [str(cell) for cell, _ in found.running] == [f"seeded on {SCENE}, seed 1"]
        assert found.seconds_left is not None
    finally:
        os.killpg(first.pid, signal.SIGKILL)
        first.wait()
    found = standing(run)
    assert (found.work, found.left, list(found.running)) == (None, 1, [])
    with locked(run):
        pass
    said = subprocess.run(
        [sys.executable, "-m", "matbench", "status", str(run), "--json"], capture_output=True, text=True, check=True
    ).stdout
    told = json.loads(said)
    assert (told["cells"], told["done"], told["left"], told["process"]) == (2, 1, 1, None)


_DISK = """
mount -t tmpfs -o size=300k none "$1" || exit 77
"$2" -c 'open("'"$1"'/large", "wb").write(bytes(200000))'
shift_out="$1"; python="$2"; shift 2
"$python" "$@" ; echo "status $?"
rm "$shift_out/large"
mount -o remount,size=30m "$shift_out"
"$python" "$@" ; echo "status $?"
cp "$shift_out/run/results.csv" "$OUT"
ls -A "$shift_out/run/cells" | grep '^\\.' && echo "drafts are left"
exit 0
"""


def test_a_full_disk_stops_the_run_and_the_same_command_ends_it(tmp_path: Path) -> None:
    """A real file system of 300 KB, in a name space of its own; 200 KB of it are taken at first."""
    if shutil.which("unshare") is None:
        pytest.skip("no unshare: a small file system cannot be mounted here")
    disk = tmp_path / "disk"
    disk.mkdir()
    line = command(BEHAVED, disk / "run", "-a", "flat", "noise", "flat[value=2]", "-s", "synthetic/box[size=240x180]")
    shell = ["unshare", "-rm", "sh", "-c", _DISK, "sh", str(disk), *line]
    environment = {**os.environ, "OUT": str(tmp_path)}
    told = subprocess.run(shell, capture_output=True, text=True, timeout=2 * PATIENCE, env=environment)
    if told.returncode in (1, 77) and "status" not in told.stdout:
        pytest.skip(f"a small file system cannot be mounted here: {told.stderr}")
    first, second = told.stdout.split("status ")[0], told.stdout.split("status ")[1]
    assert "stopped: run folder" not in first, "not where the tables are"
    assert told.stderr.count("stopped: run folder") == 1, told.stdout + told.stderr
    assert "No space left on device" in told.stderr
    assert "Traceback" not in told.stdout + told.stderr
    assert second.startswith("1\n")
    assert "status 0" in told.stdout
    assert "drafts are left" not in told.stdout
    names, scene = ["flat", "noise", "flat[value=2]"], "synthetic/box[size=240x180]"
    whole = comparison.prepare(names, scene, out=tmp_path / "whole", plugin=BEHAVED)
    whole.run()
    assert len(whole.tables().results)
    assert (tmp_path / "results.csv").read_bytes() == (tmp_path / "whole" / "results.csv").read_bytes()


def test_a_file_system_that_is_lost_is_not_taken_for_an_empty_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Simulated: the error that a lost server gives (ESTALE) is raised where files are read."""
    ready = comparison.prepare("flat", SCENE, out=tmp_path / "run", plugin=BEHAVED)
    ready.run()
    before = finished(tmp_path / "run")
    assert len(before) == 1

    def lost(*_: object, **__: object) -> str:
        raise OSError(116, "Stale file handle")

    with monkeypatch.context() as patch:
        patch.setattr(Path, "read_text", lost)
        with pytest.raises(FolderLost, match="Stale file handle"):
            ready.pending()
    assert not ready.pending().cells
    assert finished(tmp_path / "run") == before
    shutil.move(tmp_path / "run" / "cells", tmp_path / "elsewhere")  # unmounted: it looks empty
    again = evolve(ready, settings=Settings(only="all"))
    started = []
    with pytest.raises(UserError):
        again.run(lambda event, *_: (started.append(event), shutil.rmtree(tmp_path / "run" / "cells")))
    assert started == ["start"]


def test_only_and_the_dry_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def left(algorithms: list[str], only: str | None = None, repeats: int = 1) -> list[tuple[str, str]]:
        ready = comparison.prepare(
            algorithms,
            SCENE,
            out=tmp_path / "run",
            plugin=plugin,
            settings=Settings(only=only),  # type: ignore[arg-type]
            write=False,
            repeats=repeats,
        )
        return [(c.method.algorithm, why) for c, why in explained(ready.plan, ready.store, ready.settings)]

    plugin = tmp_path / "mine.py"
    shutil.copyfile(BEHAVED, plugin)
    names = ["flat", "raises", "noise"]
    assert [why for _, why in left(names)] == ["not computed yet"] * 3
    assert not (tmp_path / "run").exists(), "a dry run writes nothing"
    ready = comparison.prepare(names, SCENE, out=tmp_path / "run", plugin=plugin)
    ready.run()
    noise = ready.store.cell(ready.plan.cells[2])
    (noise / "disparity.npz").write_bytes(b"junk")
    before = {p: p.stat().st_mtime_ns for p in (tmp_path / "run").rglob("*")}
    failed = ("raises", RAISES)
    assert left(names) == [failed, ("noise", "its files are damaged")]
    assert left(names, "missing") == [("noise", "its files are damaged")]
    assert left(names, "failed") == [failed]
    line = ["compare", "-a", *names, "-s", SCENE, "--plugin", plugin, "--out", tmp_path / "run", "--dry-run", "--json"]
    with pytest.raises(SystemExit) as ended:
        main([str(word) for word in line])
    told = json.loads(capsys.readouterr().out)
    assert (ended.value.code or 0, told["cells"], [one["reason"] for one in told["todo"]]) == (
        0,
        3,
        [RAISES, "its files are damaged"],
    )
    assert left(names, "all") == [("flat", "asked for again"), failed, ("noise", "its files are damaged")]
    assert ("flat", "not computed yet") in left(names, repeats=2)
    plugin.write_text(plugin.read_text() + "\nOTHER = 1\n")
    assert [why for _, why in left(names)] == ["code changed"] * 3
    assert {p: p.stat().st_mtime_ns for p in (tmp_path / "run").rglob("*")} == before
    with pytest.raises(UserError, match="is not what it was when the run was planned"):
        raise UserError(_reason_of_first_cell(ready))

    changed = comparison.prepare(names, SCENE, out=tmp_path / "run", plugin=plugin)
    found = standing(tmp_path / "run")
    assert (found.stale, found.left) == (3, 3)
    assert prune(tmp_path / "run") == 3
    assert standing(tmp_path / "run").stale == 0
    assert not any(changed.store.cell(cell).exists() for cell in ready.plan.cells)


def _reason_of_first_cell(ready: comparison.Comparison) -> str:
    """The plan is from before its file was changed: such a cell must not be computed under the old key."""
    again = evolve(ready, settings=Settings(only="all"))
    again.run()
    outcome = again.store.outcome(again.plan.cells[0])
    assert outcome is not None
    assert outcome.status == "failed"
    return outcome.reason


def test_told_to_end_while_it_scores_it_ends_and_the_next_one_clears_away(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    run = tmp_path / "run"
    line = ["compare", "-a", "flat", "-s", SCENE, "--plugin", str(BEHAVED), "--out", str(run), "--json"]

    def ended() -> int:
        with pytest.raises(SystemExit) as stop:
            main(line)
        return int(stop.value.code or 0)

    with monkeypatch.context() as patch:
        patch.setattr(scores, "tables", lambda *_: os.kill(os.getpid(), signal.SIGTERM))
        assert ended() == 130
    told = capsys.readouterr()
    assert (told.out, told.err.splitlines()[-1]) == ("", "matbench: interrupted")
    (run / ".results.csv.abc123").touch()  # as `kill -9` leaves it
    assert ended() == 0
    assert {path.name for path in run.glob(".*")} == {".lock"}


def test_what_lies_about_who_works_is_not_believed(tmp_path: Path) -> None:
    facts = {"pid": 1, "host": "here", "since": 1.0, "running": {"0123456789abcdef": 2.0}}
    (tmp_path / ".work.json").write_text(json.dumps(facts))
    assert Work.read(tmp_path) is not None
    for lie in ({"host": "\x1b[2J"}, {"since": float("inf")}, {"running": {"0": float("nan")}}, {"pid": "x"}):
        (tmp_path / ".work.json").write_text(json.dumps({**facts, **lie}))
        assert Work.read(tmp_path) is None


def test_a_run_killed_before_its_plan_was_written_can_begin(tmp_path: Path) -> None:
    run = tmp_path / "run"
    run.mkdir()
    for name in (".lock", ".plan.json.abc123", ".work.json.77"):
        (run / name).touch()
    ready = comparison.prepare("flat", SCENE, out=run, plugin=BEHAVED)
    assert ready.store.plan() == ready.plan
    ready.store.sweep()
    assert {path.name for path in run.iterdir()} == {".lock", "plan.json", "cells"}


def test_a_cell_cannot_lead_what_is_written_or_removed_elsewhere(tmp_path: Path) -> None:
    ready = comparison.prepare("flat", SCENE, out=tmp_path / "run", plugin=BEHAVED)
    home = tmp_path / "home"
    (home / ".0123456789abcdef.secret").mkdir(parents=True)
    (home / ".removed.things").mkdir()
    before = sorted(home.rglob("*"))
    cells = tmp_path / "run" / "cells"
    cells.rmdir()
    cells.symlink_to(home)
    for attempt in (
        lambda: ready.run(),
        lambda: comparison.prepare("flat", SCENE, out=tmp_path / "run", plugin=BEHAVED),
        lambda: prune(tmp_path / "run"),
    ):
        with pytest.raises(UserError, match="is a link"):
            attempt()
    assert sorted(home.rglob("*")) == before
    cells.unlink()
    cells.mkdir()
    key = ready.plan.cells[0].key
    (cells / key).symlink_to(home)
    ready.run()
    assert sorted(home.rglob("*")) == before
    assert not (cells / key).is_symlink()
    assert len(finished(tmp_path / "run")) == 1
    (tmp_path / "run" / ".lock").unlink()
    (tmp_path / "run" / ".lock").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(UserError, match="cannot be locked"):
        ready.run()
    assert not (tmp_path / "elsewhere").exists()


def test_names_with_separators_stay_inside(tmp_path: Path) -> None:
    plugin = tmp_path / "odd.py"
    plugin.write_text(BEHAVED.read_text() + "\n\nclass Odd(Flat):\n    name = '../../odd'\n")
    with pytest.raises(UserError, match="may hold letters, digits"):
        comparison.prepare("flat", SCENE, out=tmp_path / "run", plugin=plugin)
    ready = comparison.prepare("flat", SCENE, out=tmp_path / "run", plugin=BEHAVED)
    facts = json.loads((tmp_path / "run" / "plan.json").read_text())
    for change in ({"key": "../../../evil/key"}, {"key": "0123456789ABCDEF"}, {"scene": "synthetic/box\x1b[2J"}):
        (tmp_path / "run" / "plan.json").write_text(json.dumps({**facts, "cells": [{**facts["cells"][0], **change}]}))
        with pytest.raises(UserError, match="is damaged"):
            standing(tmp_path / "run")
    (tmp_path / "run" / "plan.json").write_text(json.dumps(facts))
    place = ready.store.cell(ready.plan.cells[0])
    place.mkdir()
    (place / "cell.json").write_text('{"outcome": {"status": "ok"}}')
    spelled = '{"outcome": {"status": "failed", "reason": "one\\u001b[2J\\ntwo", "seconds": %s}}'
    (place / "cell.json").write_text(spelled % "1e999")
    assert ready.store.read(ready.plan.cells[0]).outcome is None
    (place / "cell.json").write_text(spelled % "1")
    told = ready.store.outcome(ready.plan.cells[0])
    assert told is not None
    assert told.reason == "one [2J two"
    (place / "cell.json").write_text('{"outcome": {"status": "ok"}}')
    marker = tmp_path / "executed"
    np.savez(place / "disparity.npz", view_2=np.array([_Malice(str(marker))], object))
    assert ready.store.read(ready.plan.cells[0]).outcome is None
    np.savez(place / "volume.npz", levels=np.array([_Malice(str(marker))], object), space=np.zeros(3), views=[0, 1])
    assert ready.store.volume(ready.plan.cells[0]) is None
    assert not marker.exists()


class _Malice:
    def __init__(self, path: str) -> None:
        self.path = path

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.mkdir, (self.path,)


def test_what_changes_decides_what_is_done_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Methods' code and pixels: the cell. Truth and metrics: the scores. Other plug-ins' code: nothing."""
    scene, layers = tmp_path / "scene", Layers(width=72, height=40)
    scene.mkdir()
    for view in range(3):
        write_png(scene / f"v{view}.png", layers.view(view - 1))
    write_png(scene / "truth.png", np.round((layers.truth() + 2) * 16).astype(np.uint8))
    (scene / "scene.toml").write_text(
        'views = ["v0.png", "v1.png", "v2.png"]\ndisparities = [-2, 3]\nreference = "v1.png"\npair_steps = 1\n'
        '[truth."v1.png"]\nfile = "truth.png"\nscale = 16\nunknown = 0\n'
    )
    mine, other = tmp_path / "mine.py", tmp_path / "other.py"
    mine.write_text(PLUGIN)
    other.write_text(PLUGIN.replace("Steady", "Strange").replace("Seeded", "Sown"))
    site = tmp_path / "site"  # a package with a metric, as if it were installed
    (site / "extra-1.0.dist-info").mkdir(parents=True)
    (site / "extra-1.0.dist-info" / "METADATA").write_text("Metadata-Version: 2.1\nName: extra\nVersion: 1.0\n")
    (site / "extra-1.0.dist-info" / "entry_points.txt").write_text("[matbench.metrics]\nmean = extra:METRIC\n")
    monkeypatch.syspath_prepend(site)
    run = tmp_path / "run"

    def measure(factor: int) -> None:
        """Another version of that package; all that a new process would find out is forgotten."""
        (site / "extra.py").write_text(
            "from matbench.measures.metrics import Metric\n"
            f"METRIC = Metric('mine', 'px', 'lower', 'a measure of mine', lambda e: {factor}.0 * float(e.mean()))\n"
        )
        forget()

    def forget() -> None:
        sys.modules.pop("extra", None)
        importlib.invalidate_caches()
        shutil.rmtree(site / "__pycache__", ignore_errors=True)
        for cached in (plugins.installed, plugins.code_digest, scores._metrics, freshness.digest):
            cached.cache_clear()

    def prepared(write: bool = False) -> comparison.Comparison:
        names = ["steady", "seeded", "strange"]
        return comparison.prepare(names, str(scene), out=run, plugin=[mine, other], write=write)

    def why() -> list[str]:
        ready = prepared()
        return [f"{cell.method}: {why}" for cell, why in explained(ready.plan, ready.store, ready.settings)]

    def mean(name: str, table: pd.DataFrame) -> float:
        one = (table.metric == name) & (table.region == "all") & (table.algorithm == "steady")
        return float(table[one].value.item())

    measure(1)
    try:
        ready = prepared(write=True)
        ready.run()
        first = ready.tables().results
        assert mean("mine", first) == pytest.approx(mean("avg", first))
        cells = {path: path.stat().st_mtime_ns for path in run.glob("cells/*/cell.json")}
        assert len(cells) == 3
        assert standing(run).tables == ""

        measure(10)  # another scorer
        assert "they were made by another scorer" in standing(run).tables
        write_png(scene / "truth.png", np.round((layers.truth() + 3) * 16).astype(np.uint8))  # another truth
        assert why() == []
        again, left_out = open_run(run)
        assert not left_out
        second = again.tables().results
        assert mean("mine", second) == pytest.approx(10 * mean("avg", second))
        assert mean("avg", second) != pytest.approx(mean("avg", first))
        assert standing(run).tables == ""

        other.write_text(other.read_text() + "\nLONGER = 1\n")
        assert why() == ["strange: code changed"]
        assert {path: path.stat().st_mtime_ns for path in run.glob("cells/*/cell.json")} == cells

        picture = layers.view(0)
        picture[0, 0, 0] ^= 1
        write_png(scene / "v1.png", picture)  # one bit of one pixel
        assert why() == ["steady: scene changed", "seeded: scene changed", "strange: code and scene changed"]
        with pytest.raises(UserError, match="its pixels, views or range have changed"):
            open_run(run)
    finally:
        monkeypatch.undo()
        forget()
