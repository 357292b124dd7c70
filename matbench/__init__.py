"""matbench: evaluation and benchmarking of multi-baseline stereo.

``import matbench`` is quick: each name below is imported when it is first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from matbench._version import __version__

if TYPE_CHECKING:
    from matbench.algorithm import Algorithm, Context, Estimate, Probe
    from matbench.comparison import compare
    from matbench.errors import UserError
    from matbench.scene import Range, Scene
    from matbench.scenes.catalogue import load_scene
    from matbench.space import DisparitySpace, Volume, visibility

_HOMES = {
    "Algorithm": "algorithm",
    "Context": "algorithm",
    "DisparitySpace": "space",
    "Estimate": "algorithm",
    "Probe": "algorithm",
    "Range": "scene",
    "Scene": "scene",
    "UserError": "errors",
    "Volume": "space",
    "compare": "comparison",
    "load_scene": "scenes.catalogue",
    "visibility": "space",
}

__all__ = [
    "Algorithm",
    "Context",
    "DisparitySpace",
    "Estimate",
    "Probe",
    "Range",
    "Scene",
    "UserError",
    "Volume",
    "__version__",
    "compare",
    "load_scene",
    "visibility",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'matbench' has no attribute {name!r}")
    value = getattr(import_module(f"matbench.{_HOMES[name]}"), name)
    globals()[name] = value
    return value
