"""Computed scenes kept on disk: made once, by one process or many, also such as are killed."""

import os
import signal
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager, suppress
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from types import SimpleNamespace

import pytest
from forking import in_child
from keeping import KEY, got, held, keys, scene_of
from typing_commands import SMALL, run

from matbench.errors import UserError
from matbench.files import writing
from matbench.scenes import kept
from matbench.scenes.packed import unpacked

pytestmark = pytest.mark.usefixtures("there")


def test_it_is_made_once_and_then_read(there: Path) -> None:
    assert [got(), got(), got()] == [False, True, True]
    assert held(there) == {f"{KEY}.scene"}
    assert unpacked((there / f"{KEY}.scene").read_bytes(), KEY).digest == scene_of(1).digest
    assert there.stat().st_mode & 0o777 == 0o700


def test_another_process_reads_it() -> None:
    assert not got()
    assert in_child(got)


def test_each_has_its_own() -> None:
    one, other = keys(2)
    assert [got(1, one), got(2, other), got(1, one), got(2, other)] == [False, False, True, True]


def test_what_is_made_from_nobody_knows_what_is_not_kept(there: Path) -> None:
    assert kept.scene(None, lambda: scene_of(1)).digest == scene_of(1).digest
    assert not there.exists()


def test_with_no_room_nothing_is_written_or_read(there: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(kept.VARIABLE, "0")
    assert not got()
    assert not there.exists()
    monkeypatch.setenv(kept.VARIABLE, "100")
    assert [got(), got()] == [False, True]
    monkeypatch.setenv(kept.VARIABLE, "0")
    monkeypatch.setattr(kept, "packed", lambda *_: pytest.fail("what is not kept need not be packed"))
    assert not got()


def test_without_a_home_nothing_is_kept(homeless: None) -> None:
    assert kept.folder() is None
    assert [got(), got()] == [False, False]


def test_by_default_it_is_a_gibibyte(monkeypatch: pytest.MonkeyPatch) -> None:
    for told in (None, ""):
        monkeypatch.delenv(kept.VARIABLE) if told is None else monkeypatch.setenv(kept.VARIABLE, told)
        assert kept.room() == 1 << 30


@pytest.mark.parametrize("told", ["a lot", "-1", "1.5", "1G", "９", "9999999999", " 1"])
def test_what_is_no_number_is_told_in_one_line(
    told: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv(kept.VARIABLE, told)
    with pytest.raises(UserError, match="it must be a whole number of MiB"):
        got()
    status, _, said = run(capsys, "scene", "show", SMALL)
    assert status == 2
    assert said.splitlines() == [
        f"matbench: MATBENCH_CACHE_MB is {told!r}: it must be a whole number of MiB below 10^9; 0 keeps no scenes"
    ]


def in_turn(first: int) -> int:
    """Get forty scenes three times, beginning with another one; how often one was read."""
    order = [(first + number) % 40 for number in range(40)] * 3
    return sum(got(number, f"{number:064x}", 50 + number) for number in order)


def test_many_processes_get_what_is_right(there: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(kept.VARIABLE, "5")  # half of them
    with ProcessPoolExecutor(4, get_context("fork")) as pool:
        read = list(pool.map(in_turn, [0, 0, 20, 33]))
    assert sum(read) > 40
    for path in there.iterdir():
        number = int(path.stem, 16)
        assert unpacked(path.read_bytes(), path.stem).digest == scene_of(number, 50 + number).digest
    assert len(held(there)) <= 20 + 4, "each may write one more, as it does not know of the others'"


@contextmanager
def killed_within(count: int, path: Path, settled: bool) -> Iterator[SimpleNamespace]:
    """A draft whose process is killed when so many bytes are written."""
    with writing.drafted(path, settled=settled) as file:

        def write(content: bytes) -> None:
            file.write(content[:count])
            file.flush()
            os.kill(os.getpid(), signal.SIGKILL)

        yield SimpleNamespace(write=write)


@pytest.mark.parametrize("written", [0, 100, None])
def test_a_process_that_is_killed_leaves_nothing_that_is_read(written: int | None, there: Path) -> None:
    pid = os.fork()
    if not pid:
        with suppress(BaseException):
            if written is None:  # the draft is whole, but not yet in its place
                writing.move = lambda *_: os.kill(os.getpid(), signal.SIGKILL)  # type: ignore[assignment]
            else:
                kept.drafted = partial(killed_within, written)  # type: ignore[assignment]
            kept.scene(KEY, lambda: scene_of(1))
        os._exit(1)
    assert os.waitpid(pid, 0)[1] == signal.SIGKILL
    (left,) = there.iterdir()
    assert left.name.startswith(f".{KEY}.scene.")
    assert [got(), got()] == [False, True]
    assert left.exists(), "it may be another process's, who is at it"
    os.utime(left, (1e9, 1e9))
    assert not got(2, keys(1)[0])
    assert held(there) == {f"{KEY}.scene", f"{keys(1)[0]}.scene"}
