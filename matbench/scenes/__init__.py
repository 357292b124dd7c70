"""Where scenes come from: found, fetched, checked.

Imports the basic modules, `files`, `measures` and `plans`.
"""

from functools import partial
from typing import TYPE_CHECKING

from matbench._moved import moved_name

if not TYPE_CHECKING:  # for mypy, any name would be here
    __getattr__ = partial(moved_name, __name__)
