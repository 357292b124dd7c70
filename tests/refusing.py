"""File systems that refuse some calls, and machines with several users."""

import os
import shutil
import subprocess
import sys
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import pytest
from places import TESTS


@cache
def _shim(folder: Path) -> Path:
    compiler = shutil.which("gcc") or shutil.which("cc")
    if sys.platform != "linux" or compiler is None:
        pytest.skip("no C compiler, or not Linux: calls cannot be refused")
    library = folder / "refuse.so"
    line = [compiler, "-shared", "-fPIC", "-O1", "-o", str(library), str(TESTS / "programs" / "refuse.c"), "-ldl"]
    subprocess.run(line, check=True, capture_output=True, text=True)
    return library


def refusing(folder: Path, under: Path, calls: Mapping[str, int]) -> dict[str, str]:
    """An environment in which calls fail below a folder: name (`programs/refuse.c` lists them) -> errno.

    Parameters
    ----------
    folder
        Where the library that does so is compiled to.
    """
    said = " ".join(f"{call}={number}" for call, number in calls.items())
    return {**os.environ, "LD_PRELOAD": str(_shim(folder)), "REFUSE_UNDER": str(under), "REFUSE": said}


def as_user(number: int, group: int, home: Path, umask: str = "022") -> list[str]:
    """What to write before a command so that another user of this system runs it; only root can become one.

    The user may read every file, because the interpreter may lie in a home folder, but write only what is theirs.
    """
    if os.geteuid() or shutil.which("setpriv") is None:
        pytest.skip("only root can become other users, by setpriv")
    may_read = ["--inh-caps=+dac_read_search", "--ambient-caps=+dac_read_search"]
    changed = ["setpriv", "--reuid", str(number), "--regid", str(group), "--clear-groups", *may_read]
    home.mkdir(exist_ok=True)
    os.chown(home, number, group)
    # in a name space of its own, a method could not read what only that right opens
    own = [
        "env",
        "-u",
        "XDG_DATA_HOME",
        "-u",
        "NUMBA_CACHE_DIR",
        f"HOME={home}",
        f"TMPDIR={home}",
        "MATBENCH_UNCONFINED=1",
    ]
    return [*changed, *own, "sh", "-c", f'umask {umask}; exec "$@"', "sh"]
