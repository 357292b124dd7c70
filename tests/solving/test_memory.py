"""Memory in all its forms counts, and once."""

import mmap
import os
import resource
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from forking import in_child

from matbench.solving import memory

MIB = 1 << 20


_HOLDS = """
import mmap, os, sys, time
import numpy as np
kind = sys.argv[1]
if kind == "private":
    held = np.ones(100 << 20, np.uint8)
if kind == "memfd":  # held by the kernel for this process, which has not mapped it
    number = os.memfd_create("held")
    for _ in range(100):
        os.write(number, bytes(1 << 20))
if kind == "mapped":  # the same, mapped and touched: it counts once
    number = os.memfd_create("held")
    os.ftruncate(number, 100 << 20)
    held = mmap.mmap(number, 100 << 20)
    np.frombuffer(held, np.uint8)[:] = 1
if kind == "shared":  # mapped by two processes
    held = mmap.mmap(-1, 100 << 20)
    np.frombuffer(held, np.uint8)[:] = 1
    if os.fork() == 0:
        np.frombuffer(held, np.uint8).sum()
print("ready", flush=True)
time.sleep(60)
"""


def held(kind: str) -> float:
    """MiB that a process of a kind, and all below it, hold."""
    line = [sys.executable, "-c", _HOLDS, kind]
    with subprocess.Popen(line, stdout=subprocess.PIPE, text=True, start_new_session=True) as process:
        assert process.stdout is not None
        try:
            for _ in range(2 if kind == "shared" else 1):
                assert process.stdout.readline() == "ready\n"
            return memory.used(process.pid)
        finally:
            os.killpg(process.pid, 9)


@pytest.mark.parametrize("kind", ["private", "memfd", "mapped", "shared"])
def test_every_form_counts_once(kind: str) -> None:
    more = held(kind) - held("nothing")
    # of two processes, files that others have mapped, too, count by their share: some 10 MiB less, and some more
    assert (80 if kind == "shared" else 95) < more < (130 if kind == "shared" else 110)


def test_what_has_ended_holds_nothing() -> None:
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    assert memory.used(process.pid) == 0


def test_files_left_in_shared_memory_are_known() -> None:
    path = Path("/dev/shm", f"matbench-test-{os.getpid()}")  # noqa: S108
    with path.open("w+b") as file:
        file.write(bytes(mmap.PAGESIZE))
        file.flush()
        assert path in memory.left_in_shared_memory(os.getpid())
        path.unlink()
        assert path not in memory.left_in_shared_memory(os.getpid())


def test_fresh_memory_holds_what_it_is_filled_with() -> None:
    code = (
        "import numpy as np\nfrom matbench.solving import memory\n"
        "assert memory.fill_fresh(0x41)\nprint(set(np.empty(200_000, np.uint8).tolist()))"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300, check=True)
    assert found.stdout.strip() == "{65}"
    assert np.frombuffer(b"A" * 4, np.float32)[0] == pytest.approx(12.078431)


def test_a_runaway_allocation_fails_where_it_happens() -> None:
    def limited() -> list[object]:
        memory.confine(100)
        np.ones(50 * MIB, np.uint8)
        try:
            np.ones(2000 * MIB, np.uint8)
        except MemoryError as error:
            said = type(error).__name__
        return [said, resource.getrlimit(resource.RLIMIT_CORE)[1], Path("/proc/self/oom_score_adj").read_text().strip()]

    assert in_child(limited)[:2] == ["MemoryError", 0]
    assert np.ones(500 * MIB, np.uint8)[-1] == 1, "this process is as free as before"
