"""What a process that runs methods can reach: the run folder to read only, shared memory of its own, no kept scenes.

Done in a mount namespace (Linux), which needs either the right to mount or user namespaces. Where neither is there,
nothing is confined and `shut_in` says so; what a method then rewrites is found out by digests (`matbench.solving.run`).
"""

import ctypes
import os
import sys
from contextlib import suppress
from functools import cache
from pathlib import Path

from matbench.files.temporary import temporary_folder

_NEWNS, _NEWUSER = 0x00020000, 0x10000000  # unshare(2)
_RDONLY, _NOSUID, _NODEV, _REMOUNT, _BIND, _REC, _PRIVATE = 1, 2, 4, 32, 4096, 16384, 1 << 18  # mount(2)
_CAPABILITIES, _NO_NEW_PRIVILEGES = 0x20080522, 38
# CAP_DAC_READ_SEARCH (files by handle), SYS_MODULE, SYS_RAWIO, SYS_CHROOT, SYS_PTRACE (another's root folder),
# SYS_ADMIN (mounts), SYS_BOOT, MKNOD (disks), PERFMON, BPF, CHECKPOINT_RESTORE
_GIVEN_UP = (2, 16, 17, 18, 19, 21, 22, 27, 38, 39, 40)
UNCONFINED = "MATBENCH_UNCONFINED"
SHARED_MEMORY = "/dev/shm"  # noqa: S108 -- POSIX's name for it


def shut_in(read_only: Path, shared_mb: int, hidden: Path | None = None) -> bool:
    """Let this process, and all that it starts, read a folder but not write to it; whether that worked.

    Shared memory becomes one of its own, of `shared_mb` MiB at most, which is gone when the last of them ends: what a
    method leaves there harms nobody. Then the rights by which all this could be undone are given up for good.

    Parameters
    ----------
    hidden
        A folder in whose place they see an empty one that cannot be written to. It is made if it is not there: else
        they would see it as soon as another process makes it.
    """
    if sys.platform != "linux":
        return False
    libc = ctypes.CDLL(None, use_errno=True)
    user, group = os.getuid(), os.getgid()
    if libc.unshare(_NEWNS):  # not allowed to mount as who we are: as the only user of a namespace of our own
        if libc.unshare(_NEWUSER | _NEWNS):
            return False
        for name, text in (("setgroups", "deny"), ("uid_map", f"{user} {user} 1"), ("gid_map", f"{group} {group} 1")):
            with suppress(OSError):
                Path("/proc/self", name).write_text(text)
    folder, covered = os.fsencode(read_only), None
    if hidden is not None:
        with suppress(OSError):  # where it cannot be made, nothing will be there
            hidden.mkdir(mode=0o700, parents=True, exist_ok=True)
        covered = os.fsencode(hidden) if os.path.isdir(hidden) else None  # noqa: PTH112 -- also where none may look

    def mount(source: bytes | None, target: bytes, kind: bytes | None, flags: int, options: bytes | None) -> bool:
        return bool(libc.mount(source, target, kind, ctypes.c_ulong(flags), options) == 0)

    # first cut the tie to the namespace that we come from, or everybody would see these mounts
    if not mount(None, b"/", None, _REC | _PRIVATE, None):
        return False
    if Path(SHARED_MEMORY).is_dir():
        mount(b"tmpfs", SHARED_MEMORY.encode(), b"tmpfs", _NOSUID | _NODEV, f"mode=1777,size={shared_mb}m".encode())
    if not (mount(folder, folder, None, _BIND, None) and mount(None, folder, None, _BIND | _REMOUNT | _RDONLY, None)):
        return False
    # last: the folder above may hold it, and would be bound without what is mounted in it
    flags = _NOSUID | _NODEV | _RDONLY
    if not (covered is None or mount(b"tmpfs", covered, b"tmpfs", flags, b"mode=0500")):
        return False
    return _rights_given_up(libc)


class _Header(ctypes.Structure):
    _fields_ = (("version", ctypes.c_uint32), ("pid", ctypes.c_int))


def _rights_given_up(libc: ctypes.CDLL) -> bool:
    """Give up all capabilities that reach beyond a mount namespace, also for what is started; whether that worked.

    Root keeps the others, such as to read the files of other users. (capabilities(7), prctl(2))
    """
    # effective, permitted and inheritable ones up to 31, and then those above
    header, sets = _Header(_CAPABILITIES, 0), (ctypes.c_uint32 * 6)()
    if libc.capget(ctypes.byref(header), sets):
        return False
    given_up = sum(1 << number for number in _GIVEN_UP)
    for place, word in enumerate(sets):
        sets[place] = word & ~(given_up >> 32 * (place // 3)) & 0xFFFFFFFF
    # else root would get them back with the next program that is started
    none = ctypes.c_ulong(0)
    if libc.prctl(_NO_NEW_PRIVILEGES, ctypes.c_ulong(1), none, none, none):
        return False
    return bool(libc.capset(ctypes.byref(header), sets) == 0)


@cache
def is_possible() -> bool:
    """Can a process on this system be shut in? A process that ends at once has tried it.

    Whoever has methods that need namespaces of their own, such as some containers, sets ``MATBENCH_UNCONFINED``.
    """
    if os.environ.get(UNCONFINED):
        return False
    with temporary_folder() as folder:
        pid = os.fork()
        if not pid:
            try:
                os._exit(0 if shut_in(folder, 1, folder / "hidden") else 1)
            finally:
                os._exit(1)
        return os.waitpid(pid, 0)[1] == 0


def shared_memory_mb(pid: int) -> float | None:
    """MiB that files in the shared memory of a process hold, where it has one of its own; else None."""
    with suppress(OSError):
        inside = Path("/proc", str(pid), "root" + SHARED_MEMORY)
        if inside.stat().st_dev != Path(SHARED_MEMORY).stat().st_dev:
            found = os.statvfs(inside)
            return (found.f_blocks - found.f_bfree) * found.f_frsize / 2**20
    return None
