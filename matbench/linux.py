"""What a process asks of Linux for itself: to end with its parent, to adopt orphans, to be private.

On other systems these do nothing.
"""

import ctypes
import os
import signal
import sys

# PR_SET_PDEATHSIG, PR_SET_DUMPABLE and PR_SET_CHILD_SUBREAPER of prctl(2)
_DEATH_SIGNAL, _DUMPABLE, _CHILD_SUBREAPER = 1, 4, 36


def die_with_parent(parent: int) -> None:
    """Have the system kill this process as soon as its parent, process `parent`, ends in any way."""
    _prctl(_DEATH_SIGNAL, signal.SIGKILL)  # a method may ignore every other signal
    # the parent may have ended between the fork and the line above: then no signal will come
    if os.getppid() != parent:
        os._exit(1)


def adopt_orphans() -> None:
    """Have the system make this process the parent of those below it whose own parent ends, instead of init.

    So they are found below it even where they have detached themselves.
    """
    _prctl(_CHILD_SUBREAPER, 1)


def keep_private() -> None:
    """Have the system refuse other processes of the same user a look into the memory of this one."""
    _prctl(_DUMPABLE, 0)


def _prctl(option: int, value: int) -> None:
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(option, value, 0, 0, 0)
