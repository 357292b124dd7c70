"""Where kernels that numba has compiled are kept."""

import os
from pathlib import Path


def home() -> Path:
    """The folder of all of them, below the person's folder for what can be made anew."""
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "matbench" / "kernels"
