"""matbench: evaluation and benchmarking of multi-baseline stereo.

``import matbench`` is quick: each name below is imported when it is first used.
"""

import time
from importlib import import_module
from typing import TYPE_CHECKING, Any

from matbench import _moved  # noqa: F401 -- from here on, old names of modules are found
from matbench._version import __version__

if TYPE_CHECKING:
    from matbench.algorithm import Algorithm, Context, Estimate, Probe
    from matbench.comparison import compare
    from matbench.errors import UserError
    from matbench.measures.families import Family
    from matbench.measures.metrics import MapInRegion, Metric
    from matbench.measures.prediction import PredictionMetric
    from matbench.measures.volume_metrics import VolumeMetric
    from matbench.measures.volumes import Rays
    from matbench.scene import Range, Scene
    from matbench.scenes.catalogue import load_scene
    from matbench.scenes.dataset import Dataset, Download, Listing, Remote
    from matbench.space import DisparitySpace, Volume, visibility

_LOADED = time.time()
"""No other module was read before: code that has changed since may not be what runs here."""

_HOMES = {
    "Algorithm": "algorithm",
    "Context": "algorithm",
    "Dataset": "scenes.dataset",
    "DisparitySpace": "space",
    "Download": "scenes.dataset",
    "Estimate": "algorithm",
    "Family": "measures.families",
    "Listing": "scenes.dataset",
    "MapInRegion": "measures.metrics",
    "Metric": "measures.metrics",
    "PredictionMetric": "measures.prediction",
    "Probe": "algorithm",
    "Range": "scene",
    "Rays": "measures.volumes",
    "Remote": "scenes.dataset",
    "Scene": "scene",
    "UserError": "errors",
    "Volume": "space",
    "VolumeMetric": "measures.volume_metrics",
    "compare": "comparison",
    "load_scene": "scenes.catalogue",
    "visibility": "space",
}

__all__ = [
    "Algorithm",
    "Context",
    "Dataset",
    "DisparitySpace",
    "Download",
    "Estimate",
    "Family",
    "Listing",
    "MapInRegion",
    "Metric",
    "PredictionMetric",
    "Probe",
    "Range",
    "Rays",
    "Remote",
    "Scene",
    "UserError",
    "Volume",
    "VolumeMetric",
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
