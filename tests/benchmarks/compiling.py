"""Compilation, apart: processor seconds until each method has first solved a tiny scene, with no kernel cached.

They are divided by what compiling a frozen function takes in the same process. Run as a program in a
fresh process with an empty NUMBA_CACHE_DIR; prints JSON.
"""

import json
import time
from statistics import median
from typing import Any

import numpy as np
from numba import njit
from reference import _relax, digest
from subjects import CONTEXT, METHODS, instance, scene

_TIMES = 3


def _compile_reference() -> float:
    """Seconds of compiling the reference workload's inner loop anew."""
    fresh: Any = njit(nogil=True, fastmath={"contract", "reassoc", "nsz"})(_relax.py_func)
    row = np.zeros(8, np.float32)
    begin = time.thread_time()
    fresh(row, row, np.float32(1), row.copy())
    return time.thread_time() - begin


def _first_solve(name: str) -> float:
    tiny = scene(64, 24, 3, 4)
    begin = time.thread_time()
    instance(name).solve(tiny, CONTEXT)
    first = time.thread_time()
    instance(name).solve(tiny, CONTEXT)
    return first - begin - (time.thread_time() - first)


if __name__ == "__main__":
    _compile_reference()  # numba itself wakes up
    around = [_compile_reference() for _ in range(_TIMES)]
    seconds = {name: _first_solve(name) for name in METHODS}
    around += [_compile_reference() for _ in range(_TIMES)]
    print(json.dumps({"seconds": seconds, "reference": median(around), "digest": digest()}))
