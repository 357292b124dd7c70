"""One of two trees that are measured in turns: works when it is told to, and says how long that took.

Run as a program, with the number of the core to stay on. A line that comes in is JSON, a subject and how often
it is called, 0 for making it ready; the line that goes out is ``{"seconds": ...}`` or ``{"failed": ...}``. The
first line that goes out says whose code this is.
"""

import json
import os
import sys
from functools import cache
from pathlib import Path

import cv2
from paired import Work, timed
from subjects import KERNELS, METHODS, method

import matbench


@cache
def _work(name: str) -> Work:
    return method(name) if name in METHODS else KERNELS[name]()


def seconds(name: str, calls: int) -> float:
    """Processor seconds of so many calls; of the quickest of three where none are asked for."""
    work = _work(name)
    work()  # compiled; and its memory back in the caches
    return timed(work, calls) if calls else min(timed(work, 1) for _ in range(3))


def main() -> None:
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {int(sys.argv[-1])})
    cv2.setNumThreads(1)
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)  # what methods print is no answer
    print(json.dumps({"code": str(Path(matbench.__file__).resolve().parents[1])}), file=answers)
    for line in sys.stdin:
        try:
            answer: dict[str, object] = {"seconds": seconds(*json.loads(line))}
        except Exception as error:
            said = str(error).splitlines() or [""]
            answer = {"failed": f"{type(error).__name__}: {said[0]}"}
        print(json.dumps(answer), file=answers)


if __name__ == "__main__":
    main()
