"""The memory that a cell's processes hold, in all its forms, and the limit on it (Linux).

Counted are pages of their own, pages of files that they have mapped, and shared memory. What several of them share
counts once. Shared memory counts also where nobody has mapped it: a file made by `memfd_create`, or one in the cell's
own ``/dev/shm``, holds memory all the same.
"""

import ctypes
import resource
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path

import psutil

from matbench.solving.confinement import SHARED_MEMORY, shared_memory_mb

_MIB = 1 << 20
# MiB added to the hard limit: threads reserve stacks and arenas that they never touch. The keeper ends
# a process that really holds more than its limit; this limit only stops allocations far beyond it.
_SLACK = 256
_MEMFD = ("/memfd:",)  # how the system shows files made by `memfd_create`
_BLOCK = 512  # bytes, whatever the file system: stat(2)


def used(pid: int, whole_tree: bool = True) -> float:
    """MiB that a process and all below it hold; one that has just ended holds none."""
    tree = [pid]
    if whole_tree:
        with suppress(psutil.Error):
            tree += [child.pid for child in psutil.Process(pid).children(recursive=True)]
    pages = [_pages(one, shares=len(tree) > 1) for one in tree]
    own, mapped = (sum(one[kind] for one in pages) for kind in (0, 1))
    # a file in shared memory that is mapped is counted by either way of counting: the larger one is whole
    apart = shared_memory_mb(pid)
    files = _MEMFD if apart is not None else (*_MEMFD, SHARED_MEMORY + "/")
    return own + max(mapped, _open_mb(tree, files) + (apart or 0.0))


def _pages(pid: int, shares: bool) -> tuple[float, float]:
    """MiB of a process's own pages and of mapped files, and of mapped shared memory.

    Parameters
    ----------
    shares
        Count of what is shared with other processes its share only, which takes the system a while to tell.
    """
    name, wanted, shared = "status", ("RssAnon", "RssFile"), "RssShmem"
    if shares:
        name, wanted, shared = "smaps_rollup", ("Pss_Anon", "Pss_File"), "Pss_Shmem"
    found = dict.fromkeys((*wanted, shared), 0)
    with suppress(OSError, ValueError):
        for line in Path("/proc", str(pid), name).read_text().splitlines():
            key, _, value = line.partition(":")
            if key in found:
                found[key] = int(value.split()[0])  # KiB
    return sum(found[key] for key in wanted) / 1024, found[shared] / 1024


def _open_mb(pids: Iterable[int], prefixes: tuple[str, ...]) -> float:
    """MiB of the files in shared memory that processes hold open, each counted once."""
    sizes = {}
    for link in _open_files(pids, prefixes):
        with suppress(OSError):
            facts = link.stat()
            sizes[facts.st_dev, facts.st_ino] = facts.st_blocks * _BLOCK
    return sum(sizes.values()) / _MIB


def _open_files(pids: Iterable[int], prefixes: tuple[str, ...]) -> Iterator[Path]:
    """What processes hold open of files whose names begin so, as links to them."""
    for pid in pids:
        with suppress(OSError):
            for link in Path("/proc", str(pid), "fd").iterdir():
                with suppress(OSError):
                    if str(link.readlink()).startswith(prefixes):
                        yield link


def left_in_shared_memory(pid: int) -> set[Path]:
    """The named files in shared memory that a process, or one below it, holds open now.

    For systems on which it has no shared memory of its own: what it leaves there is to be removed after its end.
    """
    with suppress(psutil.Error):
        tree = [pid, *(child.pid for child in psutil.Process(pid).children(recursive=True))]
        names = (str(link.readlink()) for link in _open_files(tree, (SHARED_MEMORY + "/",)))
        return {Path(name) for name in names if not name.endswith(" (deleted)")}
    return set()


def fill_fresh(byte: int) -> bool:
    """From now on fill memory that this process is given with a byte, and what it gives back with another one.

    A map of which pixels were never written then shows it. The GNU C library's allocator does this; False elsewhere.
    """
    with suppress(OSError, AttributeError):
        # mallopt(3), M_PERTURB: given memory gets the complement of the parameter
        return bool(ctypes.CDLL(None).mallopt(-6, byte ^ 0xFF))
    return False


def kills_for_memory() -> int:
    """How many processes Linux has killed since it booted because memory had run out; 0 where that is not known."""
    with suppress(OSError):
        for line in Path("/proc/vmstat").read_text().splitlines():
            if line.startswith("oom_kill "):
                return int(line.split()[1])
    return 0


def confine(memory: int) -> None:
    """Limit this process, and those that it starts, to `memory` MiB of further private memory.

    A runaway allocation then raises `MemoryError` where it happens, before it has taken anything. If
    the machine runs out of memory all the same, the system ends this process first. It leaves no core file.
    """
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))  # a core file is as large as the memory, and nobody reads it
    with suppress(OSError, ValueError):
        # 1000 is the highest: the system chooses this process before the harness or anything else of the user's
        Path("/proc/self/oom_score_adj").write_text("1000")
    with suppress(OSError, ValueError, StopIteration):
        lines = Path("/proc/self/status").read_text().splitlines()
        # not RLIMIT_AS: that counts reserved addresses, of which numba, OpenCV and threads take many and use few.
        # The limit counts what the process has already inherited, so that is added.
        now = next(int(line.split()[1]) for line in lines if line.startswith("VmData:")) // 1024
        limit = (now + memory + _SLACK) * _MIB
        resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))
