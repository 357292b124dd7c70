"""What a process that runs methods can reach."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from forking import beside, in_child

from matbench.files.temporary import temporary_folder
from matbench.solving import confinement
from matbench.solving.confinement import SHARED_MEMORY, shared_memory_mb, shut_in

if not confinement.is_possible():
    pytest.skip("this system lets nobody mount in a namespace of their own", allow_module_level=True)


def in_a_process(work: Callable[[], bool]) -> bool:
    """What a copy of this process finds."""
    pid = os.fork()
    if not pid:
        found = False
        try:
            found = work()
        finally:
            os._exit(0 if found else 1)
    return os.waitpid(pid, 0)[1] == 0


def test_the_folder_can_be_read_and_not_written(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "cell.json").write_text("{}")

    def is_confined() -> bool:
        assert confinement.shut_in(tmp_path / "run", 10)
        (tmp_path / "beside.txt").write_text("elsewhere it writes as before")
        assert (tmp_path / "run" / "cell.json").read_text() == "{}"
        for change in (
            lambda: (tmp_path / "run" / "cell.json").write_text("[]"),
            lambda: (tmp_path / "run" / "new").touch(),
            lambda: (tmp_path / "run" / "cell.json").unlink(),
            lambda: (tmp_path / "run").rename(tmp_path / "away"),
        ):
            try:
                change()
            except OSError:
                continue
            return False
        return True

    assert in_a_process(is_confined)
    assert (tmp_path / "run" / "cell.json").read_text() == "{}"
    assert (tmp_path / "beside.txt").exists()
    (tmp_path / "run" / "cell.json").write_text("this process writes as before")


def test_shared_memory_is_its_own_and_bounded(tmp_path: Path) -> None:
    name = Path(confinement.SHARED_MEMORY, f"matbench-test-{os.getpid()}")

    def is_bounded() -> bool:
        assert confinement.shut_in(tmp_path, 4)
        name.write_bytes(bytes(2 << 20))
        held = confinement.shared_memory_mb(os.getpid())
        try:
            name.write_bytes(bytes(8 << 20))
        except OSError:
            return held is None or held == 2  # None: seen from inside it is everybody's
        return False

    assert in_a_process(is_bounded)
    assert not name.exists()


@pytest.mark.parametrize("name", ["kept", "run/kept", "new/kept", "link"])
def test_what_is_hidden_is_empty_and_stays_so(name: str, tmp_path: Path) -> None:
    """Also where it lies in the run folder, is not there yet, or is a link; and whatever others put there later."""
    run, hidden = tmp_path / "run", tmp_path / name
    for folder in (run, tmp_path / "kept", run / "kept"):
        folder.mkdir()
        (folder / "truth").write_text("secret")
    (tmp_path / "link").symlink_to("kept")
    told, tell = os.pipe()

    def inside() -> list[object]:
        pid = os.fork()
        if not pid:  # it is not shut in
            os.read(told, 1)
            (hidden / "later").write_text("secret")
            os._exit(0)
        assert shut_in(run, 10, hidden)
        os.write(tell, b"!")
        assert not os.waitpid(pid, 0)[1]
        places = [str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.name in ("truth", "later")]
        return [*sorted(places), refused((hidden / "mine").touch)]

    every = {"kept/truth", "run/kept/truth", "run/truth"}
    seen = every - {f"{'kept' if name == 'link' else name}/truth"}
    assert in_child(inside) == [*sorted(seen), "Read-only file system"]
    assert (hidden / "later").read_text() == "secret", "others see what is there"


UNDO = """
import ctypes, os, sys
libc = ctypes.CDLL(None, use_errno=True)
def undone(run, hidden):
    ways = {
        "cover taken off": lambda: libc.umount2(os.fsencode(hidden), 2) == 0,
        "run folder let go": lambda: libc.umount2(os.fsencode(run), 2) == 0,
        "written again": lambda: libc.mount(None, os.fsencode(run), None, ctypes.c_ulong(4096 | 32), None) == 0,
        "seen through another": lambda: os.path.exists(f"/proc/{os.getppid()}/root{hidden}/truth"),
    }
    before = [way for way in ways if ways[way]()]
    libc.unshare(0x10000000 | 0x00020000)  # into namespaces of its own, where it has all rights
    return before + [way for way in ways if ways[way]()]
if __name__ == "__main__":
    print(undone(*sys.argv[1:]))
"""


@pytest.mark.parametrize("is_program", [False, True])
@pytest.mark.parametrize("user", [0, 65534])
def test_what_is_shut_in_stays_so(user: int, is_program: bool) -> None:
    """Neither the process itself nor a program that it starts can undo it, whoever it belongs to."""
    if os.getuid() and user != os.getuid():
        pytest.skip("only root becomes another user")
    with temporary_folder() as place:
        Path(place).chmod(0o777)
        run, hidden = str(Path(place, "run")), str(Path(place, "kept"))
        for folder in (run, hidden):
            Path(folder).mkdir()
        Path(hidden, "truth").write_text("secret")

        def inside() -> object:
            os.setuid(user)
            assert shut_in(Path(run), 10, Path(hidden))
            if is_program and os.access(sys.executable, os.X_OK):
                line = [sys.executable, "-c", UNDO, run, hidden]
                found: object = subprocess.run(line, check=True, capture_output=True, text=True).stdout
            else:
                exec(UNDO, here := {"__name__": "undo"})  # noqa: S102 -- what stands above
                found = f"{here['undone'](run, hidden)}\n"
            return [found, os.listdir(hidden)]  # noqa: PTH208

        assert in_child(inside) == ["[]\n", []]


def test_what_cannot_be_made_need_not_be_hidden(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    assert in_child(lambda: shut_in(tmp_path, 10, tmp_path / "file" / "kept"))


def refused(act) -> str:
    try:
        act()
    except OSError as error:
        return error.strerror or ""
    return "it worked"


def test_shared_memory_is_its_own_bounded_and_counted(tmp_path: Path) -> None:
    name = Path(SHARED_MEMORY) / f"matbench-test-{os.getpid()}"

    def inside() -> str:
        assert shut_in(tmp_path, 2)
        assert not list(Path(SHARED_MEMORY).iterdir())
        name.write_bytes(bytes(1 << 20))
        return refused(lambda: name.with_suffix(".more").write_bytes(bytes(4 << 20)))

    with beside(inside) as (pid, said):
        assert said == "No space left on device"
        assert not name.exists(), "nobody else sees it"
        assert shared_memory_mb(pid) == pytest.approx(2, abs=0.1)
    assert shared_memory_mb(pid) is None, "it has gone with its process"
    assert shared_memory_mb(os.getpid()) is None, "this process shares everybody's"
