"""Spoil real files in thousands of ways and read them: each is read, or refused in a line, in bounded time and memory.

    python tests/proofs/fuzz.py --mutants 10000

Two processes share the mutants. A mutant is told by its number and the seed: ``--only NUMBER`` makes that one again.
"""

import argparse
import contextlib
import json
import multiprocessing
import os
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Iterator
from math import inf
from pathlib import Path
from random import Random
from types import FrameType
from typing import Any

TESTS = Path(__file__).parents[1]
sys.path[:0] = [str(TESTS), str(Path(__file__).parent)]

import mutators  # noqa: E402
from corpus import Target, build  # noqa: E402

SECONDS = 4.0
"""That one mutant may take, of processor time; thirty times as much by the clock, as others may use the machine."""
MIBIBYTES = 384
"""That one mutant may take beyond what the process had before."""


class TooSlow(BaseException):
    """A mutant took its time."""


def _alarm(_: int, __: FrameType | None) -> None:
    raise TooSlow


@contextlib.contextmanager
def limited() -> Iterator[None]:
    signal.setitimer(signal.ITIMER_PROF, SECONDS)
    signal.setitimer(signal.ITIMER_REAL, 30 * SECONDS)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.setitimer(signal.ITIMER_REAL, 0)


def _memory(what: str) -> int:
    """``VmRSS`` or ``VmHWM`` of this process, MiB."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(what):
            return int(line.split()[1]) >> 10
    raise AssertionError(what)


def spoil(target: Target, place: Path, random: Random) -> str:
    """Spoil one or two files in a copy of a target; how, in words."""
    told = []
    for name in random.sample(target.files, min(len(target.files), random.choice((1, 1, 1, 2)))):
        file, chance = place / name, random.random()
        if chance < 0.06 and not target.sent:
            way: Any = random.choice(mutators.PLACE)
            file.unlink()
            way(file)
        elif chance < 0.065 and name.endswith((".zip", ".npz")):
            way = mutators.bomb
            file.write_bytes(way(b"", random))
        else:
            way = random.choice(mutators.CONTENT)
            file.write_bytes(way(file.read_bytes(), random))
        told.append(f"{way.__name__} {name}")
    return ", ".join(told)


def one(number: int, seed: int, targets: list[Target], scratch: Path) -> dict[str, Any]:
    """Make a mutant and have it read; what came of it."""
    random = Random(f"{seed} {number}")  # noqa: S311 -- no secret
    target = random.choices(targets, [1 if target.slow else 5 for target in targets])[0]
    place = scratch / "one"
    shutil.copytree(target.place, place)
    how = f"{target.name}: {spoil(target, place, random)}"
    Path("/proc/self/clear_refs").write_text("5")  # the peak of memory begins anew
    before, begin, fault, came = _memory("VmRSS"), time.monotonic(), "", "read"
    try:
        with limited():
            target.read(place)
    except target.allowed as error:
        came = "refused"
        if len(str(error).splitlines()) != 1:
            fault = f"more than a line: {str(error)[:300]!r}"
    except TooSlow:
        came, fault = "too slow", "too slow: " + "".join(traceback.format_exc()[-600:])
    except BaseException as error:
        came, fault = "raised", f"{type(error).__name__}: " + traceback.format_exc()[-900:]
    took, grown = time.monotonic() - begin, _memory("VmHWM") - before
    if grown > MIBIBYTES and not fault:
        fault = f"{grown} MiB"
    os.chdir(scratch.parent)
    shutil.rmtree(place)
    return {"number": number, "how": how, "came": came, "fault": fault, "seconds": took, "mebibytes": grown}


def part(targets: list[Target], place: Path, numbers: range, seed: int, until: float) -> None:
    """Try some of the mutants, in a process of its own: a line of JSON for each with a fault, and one at the end."""
    signal.signal(signal.SIGALRM, _alarm)
    signal.signal(signal.SIGPROF, _alarm)
    place.mkdir()
    log = os.open(place / "log", os.O_WRONLY | os.O_CREAT)
    for number in (1, 2):
        os.dup2(log, number)
    # what would take all memory of the machine fails in this process instead
    resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30))
    slowest, largest, count = 0.0, 0, Counter[str]()
    with (place / "found").open("w") as output:
        for number in numbers:
            if time.monotonic() > until:
                break
            (place / "at").write_text(str(number))
            found = one(number, seed, targets, place)
            count[found["came"]] += 1
            slowest, largest = max(slowest, found["seconds"]), max(largest, found["mebibytes"])
            if found["fault"]:
                print(json.dumps(found), file=output, flush=True)
        rss = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss >> 10
        end = {"count": count, "slowest": slowest, "largest": largest, "rss": rss, "worked": time.process_time()}
        print(json.dumps(end), file=output)


def fuzz(numbers: range, seed: int, seconds: float = inf, processes: int = 2) -> dict[str, Any]:
    """Try mutants in several processes; what came of them, and the faults."""
    faults, count, ends, begin = [], Counter[str](), [], time.monotonic()
    with tempfile.TemporaryDirectory(prefix="matbench-fuzz-") as folder:
        corpus = Path(folder) / "corpus"
        corpus.mkdir()
        targets = build(corpus)
        mutators.bombs()
        made = time.monotonic() - begin
        fork = multiprocessing.get_context("fork")
        places = [Path(folder) / f"part-{first}" for first in range(processes)]
        started = [
            fork.Process(
                target=part, args=(targets, place, numbers[first::processes], seed, time.monotonic() + seconds)
            )
            for first, place in enumerate(places)
        ]
        for process in started:
            process.start()
        for process, place in zip(started, places, strict=True):
            process.join()
            for found in map(json.loads, (place / "found").read_text().splitlines()):
                (ends if "count" in found else faults).append(found)
            if process.exitcode:
                said = (place / "log").read_text(errors="replace")[-2000:]
                faults.append({"number": (place / "at").read_text(), "how": "the process ended", "fault": said})
    for found in ends:
        count.update(found["count"])
    return {
        "mutants": count.total(),
        "seconds": round(time.monotonic() - begin - made, 1),
        "processor_seconds": [round(found["worked"], 1) for found in ends],
        "seconds_of_corpus": round(made, 1),
        "came": dict(count),
        "slowest_seconds": round(max((found["slowest"] for found in ends), default=0), 2),
        "largest_mebibytes": max((found["largest"] for found in ends), default=0),
        "resident_mebibytes": max((found["rss"] for found in ends), default=0),
        "faults": faults,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--mutants", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=inf, help="begin no further mutant after so long")
    parser.add_argument("--only", type=int, help="make this mutant alone, and show what comes of it")
    asked = parser.parse_args()
    numbers = range(asked.mutants) if asked.only is None else range(asked.only, asked.only + 1)
    found = fuzz(numbers, asked.seed, asked.seconds)
    for fault in found.pop("faults"):
        print(f"{fault['number']} {fault['how']}\n{fault['fault']}\n")
    print(json.dumps(found))


if __name__ == "__main__":
    main()
