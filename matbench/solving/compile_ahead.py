"""Kernels of built-in methods, compiled before the first cell where none are kept yet, several methods at once.

Cells are solved one after the other, so that their seconds compare, and would be compiled so, too. Only methods of the
harness itself that run by default are compiled here: all others run nowhere but in a process that a keeper watches.
Each solves noise (`python -m matbench.solving.compile_ahead`, a method a line). Whatever goes wrong, their cells
compile by themselves.
"""

import os
import subprocess
import sys
from collections import deque
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import numpy as np

from matbench.plans import kernels, plugins
from matbench.plans.limits import cores
from matbench.plans.plan import Cell

_SIZE = 16, 64  # rows and columns of the noise


def methods_to_compile(cells: Iterable[Cell]) -> list[str]:
    """Selectors of the methods of these cells that run by default, if no kernels at all are kept yet; else none."""
    kept = os.environ.get(kernels.VARIABLE)
    if not kept or next(Path(kept).rglob("*.nbi"), None) is not None:
        return []
    found = {cell.method.algorithm: cell.method for cell in cells if not cell.method.file}
    # the others may need files of the user's, or run programs, which only a keeper's process may
    own = [method for name, method in found.items() if name in plugins.default_algorithms()]
    return [f"{m.algorithm}[{m.changed}]" if m.changed else m.algorithm for m in own]


def compile_ahead(selectors: Iterable[str]) -> None:
    """Have methods compile their kernels, as many at once as there are cores; nothing for a single one."""
    waiting = deque(selectors)
    if len(waiting) < 2 or cores() < 2:
        return
    # the modules that are found here, and none of the working folder, which `-m` would look into first
    line = [sys.executable, "-P", "-m", "matbench.solving.compile_ahead"]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    many = min(cores(), len(waiting))
    running: list[subprocess.Popen[str]] = []
    with suppress(OSError), ThreadPoolExecutor(many) as pool:
        try:
            for _ in range(many):
                one = subprocess.Popen(  # noqa: S603 -- this interpreter
                    line,
                    env=environment,
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.DEVNULL,
                    text=True,
                )
                running.append(one)
            list(pool.map(lambda one: _feed(one, waiting), running))
        finally:  # in here: whoever leaves the pool waits for its threads, and these for their processes
            waiting.clear()
            for one in running:
                one.kill()
                one.wait()


def _feed(process: "subprocess.Popen[str]", waiting: "deque[str]") -> None:
    """Hand a process one method after the other, until none is left or it ends."""
    assert process.stdin is not None and process.stdout is not None, "pipes"  # noqa: S101, PT018
    with suppress(IndexError, OSError):
        while True:
            process.stdin.write(waiting.popleft() + "\n")
            process.stdin.flush()
            if not process.stdout.readline():
                return


def main() -> None:
    """Compile the methods that come in, a line each; a line goes out after each."""
    from matbench.algorithm import Context
    from matbench.plans.plan import methods
    from matbench.plans.plugins import algorithm
    from matbench.scene import Range, Scene

    views = np.random.default_rng(0).integers(0, 256, (5, *_SIZE, 3), np.uint8)
    scene = Scene("noise/noise", views, tuple("abcde"), 2, Range(0, 8), {}, 2)
    for line in sys.stdin:
        with suppress(Exception):  # its cells will tell
            (method,) = methods(line.strip())
            algorithm(method.algorithm).make(method.params).solve(scene, Context(volume=False))
        sys.stdout.write("done\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
