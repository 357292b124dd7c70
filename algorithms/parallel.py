"""Sharing rows among threads: kernels release the interpreter's lock, and results never depend on the split."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor


def share(rows: int, threads: int) -> int:
    """Rows per call, if a call costs as much as some rows: all for one thread; else eight calls per thread."""
    # eight are enough to balance the load, and one thread has none to balance
    return max(1, rows if threads <= 1 else -(-rows // (8 * threads)))


def over_views(work: Callable[[int, int, int], None], views: int, rows: int, threads: int) -> None:
    """Call ``work(view, first, end)`` for parts of `range(rows)` in each view: as many for every thread."""
    each = max(1, -(-rows // max(1, threads)))
    parts = [(view, first, min(first + each, rows)) for view in range(views) for first in range(0, rows, each)]
    over_rows(lambda number, _: work(*parts[number]), len(parts), threads, 1)


def over_rows(work: Callable[[int, int], None], rows: int, threads: int, block: int = 16) -> None:
    """Call ``work(first, end)`` for blocks that cover ``range(rows)``, on `threads` threads.

    Parameters
    ----------
    work
        Must write to its own rows only, and the same values however the rows are split.
    block
        Rows a call: few enough to balance the threads, enough to hide the cost of a call.
    """
    blocks = [(first, min(first + block, rows)) for first in range(0, rows, block)]
    if threads <= 1 or len(blocks) == 1:
        for first, end in blocks:
            work(first, end)
        return
    with ThreadPoolExecutor(threads) as pool:
        for done in [pool.submit(work, first, end) for first, end in blocks]:
            done.result()
