"""One of two trees that are measured in turns: works when it is told to, and says how long that took.

Run as a program, with the number of the core to stay on. A line that comes in is JSON, a subject and how often
it is called, 0 for making it ready; the line that goes out is ``{"seconds": ...}`` or ``{"failed": ...}``. The
first line that goes out says whose code this is.
"""

import json
import os
import sys
import time
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from subjects import Work


@cache
def _work(name: str) -> "Work":
    from subjects import KERNELS, METHODS, method

    return method(name) if name in METHODS else KERNELS[name]()


def _timed(work: "Work", calls: int) -> float:
    begin = time.process_time()
    for _ in range(calls):
        work()
    return time.process_time() - begin


def seconds(name: str, calls: int) -> float:
    """Processor seconds of so many calls; of the quickest of three where none are asked for."""
    work = _work(name)
    work()  # compiled; and its memory back in the caches
    return _timed(work, calls) if calls else min(_timed(work, 1) for _ in range(3))


def main() -> None:
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)  # what code prints is no answer
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {int(sys.argv[-1])})
    import cv2

    import matbench

    cv2.setNumThreads(1)
    print(json.dumps({"code": str(Path(matbench.__file__).resolve().parents[1])}), file=answers)
    for line in sys.stdin:
        try:
            answer: dict[str, object] = {"seconds": seconds(*json.loads(line))}
        except (Exception, SystemExit) as error:
            said = str(error).splitlines() or [""]
            answer = {"failed": f"{type(error).__name__}: {said[0]}"}
        print(json.dumps(answer), file=answers)


if __name__ == "__main__":
    main()
