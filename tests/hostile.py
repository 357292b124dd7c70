"""Methods that fight those who watch them, as a user's plug-in file. All behave while they are warmed up."""

import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
from attrs import frozen

from matbench import Context, Estimate, Scene

SLEEPS = "3597.25"
"""Seconds that what is left behind sleeps: by this number it is found."""


def _sleeper(*before: int, clean: bool = False) -> None:
    """Leave a daemon behind that first kills some processes: two forks, a session of its own, nothing open."""
    if os.fork():
        time.sleep(0.3)
        return
    os.setsid()
    if os.fork():
        os._exit(0)
    os.closerange(0, 256)
    for number in range(1, 32):
        if number not in (signal.SIGKILL, signal.SIGSTOP):
            signal.signal(number, signal.SIG_IGN)
    for pid in before:
        with suppress(OSError):
            os.kill(pid, signal.SIGKILL)
    os.execve("/bin/sleep", ["sleep", SLEEPS], {} if clean else dict(os.environ))  # noqa: S606


def _place() -> Path:
    """The folder of this process's keeper: the newest, as its open files cannot be looked at."""
    return max(Path(tempfile.gettempdir()).glob("matbench-held-*"), key=lambda place: place.stat().st_ctime)


def _draft() -> Path:
    """The folder of the cell that this process is solving."""
    (draft,) = Path(os.environ["CELLS"]).glob(".*")
    return draft


def _parent(pid: int) -> int:
    return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])


def _put(path: Path, what: str) -> None:
    """Put something else than a plain file there."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)
    if what == "pipe":
        os.mkfifo(path)
    elif what == "endless":
        path.symlink_to("/dev/zero")
    elif what == "victim":
        path.symlink_to(os.environ["VICTIM"])
    elif what == "sparse":
        with path.open("wb") as file:
            file.truncate(1 << 40)
    elif what == "socket":
        with socket.socket(socket.AF_UNIX) as one:
            os.chdir(path.parent)
            one.bind(path.name)
    elif what == "device":
        os.mknod(path, 0o600 | 0o020000, os.makedev(1, 5))  # /dev/zero by another name
    elif what == "deep":
        path.mkdir()
        floor = os.open(path, os.O_RDONLY)
        for _ in range(2000):
            os.mkdir("floor", dir_fd=floor)
            below = os.open("floor", os.O_RDONLY, dir_fd=floor)
            os.close(floor)
            floor = below
        os.close(floor)
    elif what == "shut":
        (path / "in").mkdir(parents=True)
        path.chmod(0)


class _Hostile:
    def solve(self, scene: Scene, context: Context) -> Estimate:
        if scene.width > 64:
            self.fight()
        return Estimate({scene.ref: np.ones((scene.height, scene.width), np.float32)})

    def fight(self) -> None:
        raise NotImplementedError


class StopsKeeper(_Hostile):
    def fight(self) -> None:
        os.kill(os.getppid(), signal.SIGSTOP)
        time.sleep(3600)


@frozen
class KillsKeeper(_Hostile):
    """With a daemon that keeps its environment, or has none."""

    clean: bool = False

    def fight(self) -> None:
        _sleeper(os.getppid(), clean=self.clean)
        time.sleep(3600)


class KillsServer(_Hostile):
    """Its keeper's parent, too."""

    def fight(self) -> None:
        keeper = os.getppid()
        _sleeper(_parent(keeper), keeper)
        time.sleep(3600)


class StopsServer(_Hostile):
    """So that no other keeper can be started."""

    def fight(self) -> None:
        os.kill(_parent(os.getppid()), signal.SIGSTOP)
        os.kill(os.getppid(), signal.SIGKILL)
        time.sleep(3600)


class KillsRun(_Hostile):
    """All that is above it; once."""

    def fight(self) -> None:
        mark = Path(os.environ["VICTIM"]).with_name("fought")
        if mark.exists():
            return
        mark.touch()
        keeper = os.getppid()
        server = _parent(keeper)
        _sleeper(_parent(server), server, keeper)
        time.sleep(3600)


class Multiplies(_Hostile):
    """A tree of processes that do not mind signals."""

    def fight(self) -> None:
        own = os.getpid()
        for _ in range(4):
            os.fork()
        if os.getpid() != own:
            for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT):
                signal.signal(number, signal.SIG_IGN)
            time.sleep(3600)
        _sleeper()


class Deaf(_Hostile):
    """Blocks all signals, and waits."""

    def fight(self) -> None:
        signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())
        time.sleep(3600)


class StopsItself(_Hostile):
    def fight(self) -> None:
        os.kill(os.getpid(), signal.SIGSTOP)


class Closes(_Hostile):
    """Closes whatever is open."""

    def fight(self) -> None:
        os.closerange(0, 1024)


class Quits(_Hostile):
    def fight(self) -> None:
        os._exit(0)


@frozen
class Babbles(_Hostile):
    """Says to its keeper what is no message."""

    what: str = "huge"

    def fight(self) -> None:
        said = {"huge": b"\x7f\xff\xff\xff", "half": b'{"word": "do', "long": b"x" * (1 << 20), "early": b""}[self.what]
        if self.what == "early":
            said = b'{"word": "begins"}\n{"word": "ends"}\n{"word": "done", "is_fit": true}\n'
        for number in range(3, 64):
            with suppress(OSError):
                if Path(f"/proc/self/fd/{number}").readlink().name.startswith("socket:"):
                    os.write(number, said)
        if self.what == "half":
            time.sleep(3600)


class HoldsOutput(_Hostile):
    """Answers, and leaves somebody behind who prints without end."""

    def fight(self) -> None:
        subprocess.Popen([sys.executable, "-c", "while True: print('x' * 10000)"], start_new_session=True)


class EatsInChildren(_Hostile):
    """Each takes a little."""

    def fight(self) -> None:
        for _ in range(4):
            if not os.fork():
                kept = [np.ones(1 << 24) for _ in range(1)]
                time.sleep(3600)
                print(len(kept))
        time.sleep(3600)


@frozen
class Answers(_Hostile):
    """Answers by something else than plain files."""

    file: str = "disparity.npz"
    what: str = "none"

    def fight(self) -> None:
        from matbench.solving import worker

        write = worker._write

        def worse(answer: object, folder: Path) -> None:
            write(answer, folder)
            _put(folder / self.file, self.what)

        worker._write = worse


@frozen
class Spoils(_Hostile):
    """Puts something else where its keeper keeps scenes and answers, or takes that away."""

    what: str = "none"
    file: str = ""

    def fight(self) -> None:
        _put(_place() / self.file, self.what)


@frozen
class Drafts(_Hostile):
    """Puts something else into the folder of its cell, or in its place."""

    file: str = "log.txt"
    what: str = "none"

    def fight(self) -> None:
        _put(_draft() / self.file, self.what)


class Fair(_Hostile):
    def fight(self) -> None:
        pass
