"""A control group for the processes of a method, where the system lets this user make one (Linux).

The kernel counts for it whatever its processes have allocated, in whatever form, also in files of any memory file
system and after a process has let go of them. Where no group can be had, `matbench.solving.memory` samples processes.
"""

import os
from contextlib import suppress
from pathlib import Path
from typing import Self

from attrs import frozen

ROOT = Path("/sys/fs/cgroup")
_COUNTED = ("anon", "rss", "shmem")  # version 2 calls private pages anon, version 1 rss


@frozen
class ControlGroup:
    """A group below the one of this process.

    Parameters
    ----------
    folder
        Where the kernel shows it.
    """

    folder: Path

    @classmethod
    def make(cls, root: Path = ROOT) -> Self | None:
        """A new group that counts memory; None where none can be had."""
        name = f"matbench-{os.getpid()}"
        for base in _bases(root):
            group = cls(base / name)
            with suppress(OSError):
                group.folder.mkdir(exist_ok=True)
                if group.used() is not None:
                    return group
                group.folder.rmdir()
        return None

    def take(self, pid: int) -> None:
        """Have a process, and all that it starts from now on, count in the group."""
        with suppress(OSError):
            (self.folder / "cgroup.procs").write_text(str(pid))

    def used(self) -> float | None:
        """MiB that its processes have allocated and nobody has freed; None where the kernel does not say."""
        found = {}
        with suppress(OSError, ValueError):
            for line in (self.folder / "memory.stat").read_text().splitlines():
                name, _, value = line.partition(" ")
                if name in _COUNTED:
                    found[name] = int(value)
        return sum(found.values()) / 2**20 if found else None

    def remove(self) -> None:
        """Remove it once all its processes have ended."""
        with suppress(OSError):
            self.folder.rmdir()


def _bases(root: Path) -> list[Path]:
    """The groups of this process in which another one that counts memory may be made: of either version."""
    bases = []
    with suppress(OSError, ValueError):
        for line in Path("/proc/self/cgroup").read_text().splitlines():
            _, controllers, path = line.split(":", 2)
            if not controllers:
                bases.append(root / path.lstrip("/"))
            elif "memory" in controllers.split(","):
                bases.append(root / "memory" / path.lstrip("/"))
    return bases
