"""Methods that do the worst, as a user's plug-in file. All behave while they are warmed up."""

import ctypes
import multiprocessing
import os
import signal
import stat
import subprocess
import sys
import threading
import time
from collections import deque
from contextlib import suppress
from itertools import repeat
from pathlib import Path

import numpy as np
from attrs import frozen

from matbench import Context, Estimate, Scene


def _flat(scene: Scene, value: float = 1) -> Estimate:
    return Estimate({scene.ref: np.full((scene.height, scene.width), value, np.float32)})


def _is_warm_up(scene: Scene) -> bool:
    return scene.width <= 64


class _Rough:
    def solve(self, scene: Scene, context: Context) -> Estimate:
        if not _is_warm_up(scene):
            print(f"{type(self).__name__} begins")
            self.misbehave(scene)
        return _flat(scene)

    def misbehave(self, scene: Scene) -> None:
        raise NotImplementedError


class Segfaults(_Rough):
    def misbehave(self, scene: Scene) -> None:
        ctypes.string_at(0)


class Aborts(_Rough):
    def misbehave(self, scene: Scene) -> None:
        os.abort()


class Overflows(_Rough):
    """Recurses without end, having taken away what would stop it."""

    def misbehave(self, scene: Scene) -> None:
        sys.setrecursionlimit(1 << 30)

        def deeper(values: list[int]) -> list[int]:
            return sorted([1, 2], key=lambda _: deeper(values))

        deeper([])


class Loops(_Rough):
    """Never ends, in C that holds the interpreter's lock, and minds no signal."""

    def misbehave(self, scene: Scene) -> None:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        deque(repeat(0), maxlen=0)


class Allocates(_Rough):
    """Asks for a terabyte."""

    def misbehave(self, scene: Scene) -> None:
        np.ones(1 << 37)


class Grows(_Rough):
    """Takes more and more, a little at a time, in a process that it starts, and talks meanwhile."""

    def misbehave(self, scene: Scene) -> None:
        if os.fork() == 0:
            kept = []
            while True:
                kept.append(np.ones(1 << 19))
                time.sleep(0.04)
        while True:
            print("still here")
            time.sleep(0.01)


class Chatters(_Rough):
    """Prints 32 MB, from Python and from C."""

    def misbehave(self, scene: Scene) -> None:
        for number in range(32):
            print("x" * (1 << 20))
            os.write(1, f"line {number}\n".encode())
        ctypes.CDLL(None).puts(b"the last line, from C")


class Upsets(_Rough):
    """Leaves its process in disorder."""

    def misbehave(self, scene: Scene) -> None:
        os.environ.clear()
        os.environ["HOME"] = "/nowhere"
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGABRT):
            signal.signal(number, signal.SIG_IGN)
        os.chdir("/")
        sys.stdout.close()
        sys.stderr = None
        os.closerange(0, 3)
        sys.setrecursionlimit(1 << 20)
        threading.Thread(target=time.sleep, args=[3600]).start()


class Breeds(_Rough):
    """Leaves processes behind: a copy of its own, one in a session of its own, and another program."""

    def misbehave(self, scene: Scene) -> None:
        for is_leader in (False, True):
            if os.fork() == 0:
                if is_leader:
                    os.setsid()
                signal.signal(signal.SIGTERM, signal.SIG_IGN)
                time.sleep(3600)
        subprocess.Popen(["sleep", "3600"], start_new_session=True)
        multiprocessing.get_context("fork").Process(target=time.sleep, args=[3600]).start()


class Scribbles(_Rough):
    """Writes into every socket that is open, as a library may that has closed its own twice."""

    def misbehave(self, scene: Scene) -> None:
        for number in range(3, 256):
            with suppress(OSError):
                if stat.S_ISSOCK(os.fstat(number).st_mode):
                    os.write(number, b"\0\0\1\0")  # to `multiprocessing`: 256 bytes follow


class Splits(_Rough):
    """Comes back from `solve` twice, in two processes."""

    def misbehave(self, scene: Scene) -> None:
        os.fork()


class Interrupts(_Rough):
    def misbehave(self, scene: Scene) -> None:
        raise KeyboardInterrupt


class Tampers(_Rough):
    """Writes into its input although it is read-only."""

    def misbehave(self, scene: Scene) -> None:
        ctypes.memset(scene.views.ctypes.data, 0, scene.views.nbytes)


class Orphans(_Rough):
    """Kills its parent."""

    def misbehave(self, scene: Scene) -> None:
        os.kill(os.getppid(), signal.SIGKILL)
        time.sleep(3600)


@frozen
class Tells:
    """Says in which process, and with how many threads, it runs: the answer is the process's number."""

    wait: float = 0.0
    mark: int = 0

    def solve(self, scene: Scene, context: Context) -> Estimate:
        import cv2
        import numba
        import threadpoolctl

        blas = max([pool["num_threads"] for pool in threadpoolctl.threadpool_info()], default=1)
        numbers = context.threads, blas, numba.get_num_threads(), cv2.getNumThreads(), os.environ["OMP_NUM_THREADS"]
        if not _is_warm_up(scene):
            print("threads", *numbers, "HOME" in os.environ, Path.cwd())
            time.sleep(self.wait)
        return _flat(scene, float(os.getpid()))
