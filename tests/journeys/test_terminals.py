"""Pipes and terminals as people have them: cut, full, closed, of another encoding, of no width; and early Ctrl-C."""

import os
import pty
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from compared import SMALL, cells
from places import METHODS

TINY = "synthetic/box[size=48x36]"
TABLES = {"cells.csv", "results.csv", "report.html", "scores.json", "plan.json"}
FULL = b"matbench: standard output could not be written: No space left on device\n"
MATBENCH = f"{sys.executable} -m matbench"


@pytest.fixture(autouse=True)
def _hung_up_as_usual() -> Iterator[None]:
    """A closed terminal ends what it has started, also where these tests were started by `nohup`."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, before)


def shell(place: Path, line: str, **environment: str) -> "subprocess.CompletedProcess[bytes]":
    """Run a shell's line, in which `matbench` is this one; its status is that of the first command of a pipe."""
    line = line.replace("matbench ", f"{MATBENCH} ", 1) + "\nexit ${PIPESTATUS[0]}"
    given = {**os.environ, **environment}
    return subprocess.run(["bash", "-c", line], cwd=place, env=given, capture_output=True, timeout=600)


def is_whole(run: Path) -> bool:
    return {path.name for path in run.iterdir()} >= TABLES


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where a run lies whose reader has left after the first line."""
    place = tmp_path_factory.mktemp("terminals")
    done = shell(place, f"matbench compare -a flat --plugin {METHODS} -s '{TINY}' --out run | head -1")
    assert (done.returncode, done.stderr) == (0, b"")
    assert is_whole(place / "run")
    return place


def test_a_computation_goes_on_to_its_end_without_streams(tmp_path: Path) -> None:
    line = f"matbench compare -a flat leaves --plugin {METHODS} -s '{TINY}' --out run <&- >&- 2>&-"
    assert shell(tmp_path, line).returncode == 1, "a cell failed, as with streams"
    assert is_whole(tmp_path / "run")


@pytest.mark.parametrize("line", ["--help", "report run --format md"])
def test_a_listing_says_by_its_status_whether_it_arrived(run: Path, line: str) -> None:
    cut, full = (shell(run, f"matbench {line} {where}") for where in ("| true", "> /dev/full"))
    assert (cut.returncode, cut.stderr) == (0, b"")
    assert (full.returncode, full.stderr) == (1, FULL)


def test_only_what_is_in_no_file_is_lost(run: Path) -> None:
    line = f"matbench compare -a flat --plugin {METHODS} -s '{TINY}' --out run"
    tables, document = (shell(run, f"{line} {more} > /dev/full") for more in ("", "--json"))
    assert (tables.returncode, tables.stderr) == (0, FULL)
    assert document.returncode == 1
    assert document.stderr.endswith(FULL)


@pytest.mark.parametrize(("line", "status"), [("list", 0), ("report run", 0), ("nonsense", 2)])
def test_any_encoding_and_width_will_do(run: Path, line: str, status: int) -> None:
    plain = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    for environment in ({"PYTHONIOENCODING": "ascii", "COLUMNS": "0"}, {**plain, "COLUMNS": "abc", "TERM": "dumb"}):
        done = shell(run, f"matbench {line}", **environment)
        assert done.returncode == status, done.stderr
        assert len((done.stdout + done.stderr).split()) > 10, "it is all there"
        assert b"Traceback" not in done.stderr
        assert (done.stdout + done.stderr).isascii()


class Terminal:
    """A process in a terminal of its own, that is written to a file as it comes."""

    def __init__(self, place: Path, *tokens: object, ignored: bool = False, **environment: str) -> None:
        self.pid, self.master = pty.fork()
        if self.pid == 0:
            os.chdir(place)
            if ignored:
                signal.signal(signal.SIGHUP, signal.SIG_IGN)
            os.environ.update(environment)
            os.execv(sys.executable, [sys.executable, "-m", "matbench", *map(str, tokens)])  # noqa: S606

    def read_until(self, happens: Callable[[], object], seconds: float = 300) -> bytes:
        said, end = b"", time.monotonic() + seconds
        os.set_blocking(self.master, False)
        while not happens():
            assert time.monotonic() < end, said.decode(errors="replace")
            try:
                said += os.read(self.master, 1 << 16)
            except BlockingIOError:
                time.sleep(0.02)
            except OSError:  # the other end is closed
                break
        return said

    def close(self) -> None:
        os.close(self.master)

    def status(self, seconds: float = 300) -> int:
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                return os.waitstatus_to_exitcode(status)
            time.sleep(0.05)
        os.kill(self.pid, signal.SIGKILL)
        raise AssertionError("it did not end")


def begun(place: Path) -> Callable[[], bool]:
    return lambda: any((place / "run" / "cells").glob("[0-9a-f]*"))


def test_a_terminal_that_is_closed_ends_the_run_with_its_tables(tmp_path: Path) -> None:
    line = ("compare", "-a", "flat", "slow", "--plugin", METHODS, "-s", SMALL, "--out", "run")
    terminal = Terminal(tmp_path, *line, TERM="xterm")
    terminal.read_until(begun(tmp_path))
    time.sleep(0.5)
    terminal.close()
    assert terminal.status() == 130
    assert is_whole(tmp_path / "run")
    assert cells(tmp_path).status.to_dict() == {"flat": "ok", "slow": "interrupted"}


def test_a_run_that_is_to_outlive_its_terminal_does(tmp_path: Path) -> None:
    line = ("compare", "-a", "flat", "sgbm", "noise", "--plugin", METHODS, "-s", TINY, "--out", "run")
    terminal = Terminal(tmp_path, *line, ignored=True, TERM="xterm")
    terminal.read_until(begun(tmp_path))
    terminal.close()
    assert terminal.status() == 0
    assert is_whole(tmp_path / "run")
    assert set(cells(tmp_path).status) == {"ok"}


def test_a_terminal_without_size_or_name_shows_all(tmp_path: Path, run: Path) -> None:
    terminal = Terminal(run, "report", "run", TERM="", COLUMNS="0")  # the size of a new pty is 0 x 0
    said = terminal.read_until(lambda: False)
    assert terminal.status() == 0
    assert b"flat" in said
    assert b"\x1b" not in said


def test_ctrl_c_at_any_moment_is_told_in_a_line(tmp_path: Path) -> None:
    """From the first line of matbench on; before it, Python itself is starting."""
    code = "import os, sys; os.write(1, b'x'); from matbench.__main__ import main; main()"
    line = [sys.executable, "-c", code, "compare", "-a", "sgbm", "-s", TINY, "--out", "run"]
    for delay in (0.03, 0.1, 0.3, 0.6, 1.0, 1.5):
        process = subprocess.Popen(
            line, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True
        )
        assert process.stdout is not None
        process.stdout.read(1)
        time.sleep(delay)
        os.killpg(process.pid, signal.SIGINT)
        _, told = process.communicate(timeout=300)
        assert (process.returncode, told) in [(130, b"matbench: interrupted\n"), (130, b""), (0, b"")], delay
