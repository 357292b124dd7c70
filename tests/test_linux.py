"""What a process asks of Linux for itself."""

import ctypes
import os
import signal
import sys
import time

import psutil
import pytest
from forking import in_child
from waiting import lives, wait_until

from matbench import linux

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="done by Linux's calls")


def test_a_process_dies_with_its_parent() -> None:
    def act() -> int:
        parent = os.getpid()
        if pid := os.fork():
            return pid  # and this parent ends
        os.close(1)  # nobody waits for what it inherits
        os.closerange(3, 64)
        linux.die_with_parent(parent)
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        time.sleep(600)
        os._exit(0)

    pid = in_child(act)
    wait_until(lambda: not lives(pid))


def test_who_comes_too_late_dies_at_once() -> None:
    pid = os.fork()
    if not pid:
        linux.die_with_parent(1)  # its parent is another one
        os._exit(0)
    assert os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 1


def test_memory_is_kept_private() -> None:
    def dumpable() -> int:
        return int(ctypes.CDLL(None).prctl(3, 0, 0, 0, 0))  # PR_GET_DUMPABLE

    def act() -> list[int]:
        before = dumpable()
        linux.keep_private()
        return [before, dumpable()]

    assert in_child(act) == [1, 0]


def test_orphans_come_to_the_process_that_adopts_them() -> None:
    def act() -> bool:
        linux.adopt_orphans()
        if not (between := os.fork()):
            if not os.fork():
                time.sleep(600)
            os._exit(0)
        os.waitpid(between, 0)
        (orphan,) = psutil.Process().children()
        orphan.kill()
        return os.waitpid(orphan.pid, 0)[0] == orphan.pid

    assert in_child(act)
