"""The paired ratio: how long a subject takes in units of the frozen reference workload, measured around it.

Every round is reference, subject, reference, some milliseconds each, in the processor time of this thread:
what other programs do to the machine they do to all three, and what they take from the processor counts
for none. The figure of a subject is the median over the rounds.
"""

import time
from collections.abc import Callable

import numpy as np
from pytest_benchmark.fixture import BenchmarkFixture
from reference import Reference

SLICE = 0.004  # seconds that a subject takes at least in a round: long for the timer, short for most disturbances
AROUND = 0.02  # seconds that the reference takes at most in a round, before and after the subject together
PART, FEWEST = 0.25, 5  # seconds after which a part has rounds enough of a long subject, but never fewer rounds

Work = Callable[[], object]


def timed(work: Work, calls: int) -> float:
    """Seconds of this thread's processor time that so many calls take."""
    begin = time.thread_time()
    for _ in range(calls):
        work()
    return time.thread_time() - begin


def calls_in(work: Work, seconds: float) -> int:
    """How many calls take about so long, by the quickest of three; at least one."""
    return max(1, round(seconds / max(min(timed(work, 1) for _ in range(3)), 1e-6)))


def measure(benchmark: BenchmarkFixture, work: Work, reference: Reference, rounds: int) -> None:
    """Benchmark a subject; the ratio of every round and what it was measured with go to ``extra_info``."""
    work()  # compiled, and its memory touched
    reference()
    call = min(timed(work, 1) for _ in range(3))
    calls = max(1, round(SLICE / max(call, 1e-6)))
    around = calls_in(reference, min(calls * call, AROUND) / 2)
    enough = max(FEWEST, round(PART / (calls * call)))
    before: list[float] = []
    after: list[float] = []

    def reference_before() -> None:
        reference()  # back into the caches, should another program have had them
        before.append(timed(reference, around))

    def subject() -> None:
        for _ in range(calls):
            work()

    benchmark.pedantic(
        subject,
        setup=reference_before,
        teardown=lambda: after.append(timed(reference, around)),
        rounds=min(rounds, enough),
    )
    if benchmark.disabled:
        return
    taken = np.array(benchmark.stats.stats.data) / calls
    per_reference = (np.array(before) + np.array(after)) / (2 * around)
    benchmark.extra_info.update(
        ratios=(taken / per_reference).tolist(),
        seconds=float(np.median(taken)),
        reference_seconds=float(np.median(per_reference)),
        calls=calls,
        reference_calls=around,
    )
