"""Kernels of built-in methods, compiled while the plan is made where none are kept yet, several methods at once.

Cells are solved one after the other, so that their seconds compare, and would be compiled so, too. Only methods of the
harness itself that run by default are compiled here: all others run nowhere but in a process that a keeper watches.
Each solves noise (`python -m matbench.solving.compile_ahead`, a method a line). Whatever goes wrong, their cells
compile by themselves.
"""

import os
import subprocess
import sys
from collections import deque
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from threading import Thread

import numpy as np
from attrs import define, field

from matbench import linux
from matbench.plans import kernels, plugins
from matbench.plans.limits import cores
from matbench.plans.plan import Method

_SIZE = 16, 64  # rows and columns of the noise


def methods_to_compile(methods: Iterable[Method], kept: Path) -> list[str]:
    """Selectors of those methods that run by default, if that folder keeps no kernels of the code as it is; else none.

    In the order in which to compile them: first what brings most code, then what adds most to it. So two that share
    their kernels are not compiled at once, each for itself.
    """
    # the others may need files of the user's, or run programs, which only a keeper's process may
    own = set(plugins.default_algorithms())
    left = {method.algorithm: method for method in methods if not method.file and method.algorithm in own}
    code = {name: _sizes(name) for name in left}
    changed = max((_written(file) for sizes in code.values() for file in sizes), default=0.0)
    if any(_written(kernel) > changed for kernel in kept.rglob("*.nbi")):
        return []
    claimed: set[Path] = set()
    found = []
    while left:
        name = max(left, key=lambda one: sum(size for file, size in code[one].items() if file not in claimed))
        claimed.update(code[name])
        method = left.pop(name)
        found.append(f"{name}[{method.changed}]" if method.changed else name)
    return found


def _sizes(algorithm: str) -> dict[Path, int]:
    """File -> bytes, of all code of a method."""
    files = plugins.code_of(plugins.installed("algorithms")[algorithm]).files.values()
    return {file: file.stat().st_size for file in files}


def _written(file: Path) -> float:
    """When a file was written; 0 if it is gone."""
    try:
        return file.stat().st_mtime
    except OSError:
        return 0.0


@define(eq=False)
class Ahead:
    """Methods that are being compiled, by processes beside this one: as many as there are cores.

    It is waited for or stopped (`wait`, `stop`). Its processes end with this one.
    """

    _waiting: deque[str]
    _running: list["subprocess.Popen[str]"] = field(factory=list)
    _threads: list[Thread] = field(factory=list)

    @classmethod
    def begin(cls, selectors: Sequence[str], kept: Path) -> "Ahead":
        """Start to compile methods into a folder; nothing is started for a single one, or a single core."""
        ahead = cls(deque(selectors))
        many = min(cores(), len(selectors))
        if many < 2:
            return ahead
        # the modules that are found here, and none of the working folder, which `-m` would look into first
        line = [sys.executable, "-P", "-m", "matbench.solving.compile_ahead"]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path)), kernels.VARIABLE: str(kept)}
        with suppress(OSError):
            for _ in range(many):
                one = subprocess.Popen(  # noqa: S603 -- this interpreter
                    line,
                    env=environment,
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.DEVNULL,
                    text=True,
                )
                ahead._running.append(one)
        for one in ahead._running:
            ahead._threads.append(Thread(target=ahead._feed, args=(one,), daemon=True))
            ahead._threads[-1].start()
        return ahead

    def wait(self) -> None:
        """Go on when all is compiled; whoever is interrupted meanwhile has stopped it."""
        try:
            for thread in self._threads:
                thread.join()
        finally:
            self.stop()

    def stop(self) -> None:
        """End its processes, whatever they do."""
        self._waiting.clear()
        for one in self._running:
            one.kill()
            one.wait()
        for thread in self._threads:
            thread.join()
        for one in self._running:
            for pipe in filter(None, (one.stdin, one.stdout)):
                with suppress(OSError):
                    pipe.close()
        self._running.clear()
        self._threads.clear()

    def _feed(self, process: "subprocess.Popen[str]") -> None:
        """Hand a process one method after the other, until none is left or it ends."""
        assert process.stdin is not None and process.stdout is not None, "pipes"  # noqa: S101, PT018
        with suppress(IndexError, OSError, ValueError):
            while True:
                process.stdin.write(self._waiting.popleft() + "\n")
                process.stdin.flush()
                if not process.stdout.readline():
                    return


def main() -> None:
    """Compile the methods that come in, a line each; a line goes out after each."""
    from matbench.algorithm import Context
    from matbench.plans.plan import methods
    from matbench.plans.plugins import algorithm
    from matbench.scene import Range, Scene

    linux.die_with_parent(os.getppid())
    views = np.random.default_rng(0).integers(0, 256, (5, *_SIZE, 3), np.uint8)
    scene = Scene("noise/noise", views, tuple("abcde"), 2, Range(0, 8), {}, 2)
    for line in sys.stdin:
        with suppress(Exception):  # its cells will tell
            (method,) = methods(line.strip())
            algorithm(method.algorithm).make(method.params).solve(scene, Context())  # as the warm-up of its cells does
        sys.stdout.write("done\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
