"""Where scenes come from: found, fetched, checked.

Imports the basic modules, `files`, `measures` and `plans`.
"""

from matbench._moved import scene_name as __getattr__

__all__ = ["__getattr__"]
