"""Old names of modules that have moved into packages: plug-ins of others go on importing them, and are warned."""

import sys
import warnings
from importlib import import_module
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

MODULES = {
    "matbench.ablation": "matbench.results.ablation",
    "matbench.archive": "matbench.results.archive",
    "matbench.cluster": "matbench.solving.cluster",
    "matbench.contract": "matbench.solving.method_check",
    "matbench.dataset": "matbench.scenes.dataset",
    "matbench.keeper": "matbench.solving.keeper",
    "matbench.metrics": "matbench.measures.metrics",
    "matbench.plan": "matbench.plans.plan",
    "matbench.prediction": "matbench.measures.prediction",
    "matbench.recorded": "matbench.plans.record_option",
    "matbench.run": "matbench.solving.run",
    "matbench.settings": "matbench.plans.settings",
    "matbench.statistics": "matbench.measures.statistics",
    "matbench.store": "matbench.runs.store",
    "matbench.sweeps": "matbench.results.sweeps",
    "matbench.volume_metrics": "matbench.measures.volume_metrics",
    "matbench.volumes": "matbench.measures.volumes",
}
"""Old name -> where it is now."""

SCENES = ("data_root", "listings", "load_scene", "select")
"""What was in the module ``matbench.scenes``, now a package: it is in `matbench.scenes.catalogue`."""


def _warn(old: str, new: str, stacklevel: int) -> None:
    warnings.warn(f"{old} has moved: import {new}", DeprecationWarning, stacklevel=stacklevel + 1)


class Finder:
    """Finds modules under their old names; it is asked last, so that it costs nothing else anything."""

    def find_spec(self, name: str, *_: object) -> ModuleSpec | None:
        """A spec with the file of the new module, so that whoever reads code finds it; nothing for other names."""
        if name not in MODULES:
            return None
        from importlib.util import find_spec

        found = find_spec(MODULES[name])
        spec = ModuleSpec(name, self, origin=None if found is None else found.origin)  # type: ignore[arg-type]
        spec.has_location = spec.origin is not None
        return spec

    def create_module(self, spec: ModuleSpec) -> None:
        """The usual empty module."""

    def exec_module(self, module: ModuleType) -> None:
        """Put the new module in the place of the old one: both names mean the same."""
        _warn(module.__name__, MODULES[module.__name__], 2)
        sys.modules[module.__name__] = import_module(MODULES[module.__name__])


def scene_name(name: str) -> Any:
    """One of `SCENES`, taken from ``matbench.scenes``.

    Raises
    ------
    AttributeError
        For any other name.
    """
    if name not in SCENES:
        raise AttributeError(f"module 'matbench.scenes' has no attribute {name!r}")
    _warn(f"matbench.scenes.{name}", f"matbench.scenes.catalogue.{name}", 2)
    value = getattr(import_module("matbench.scenes.catalogue"), name)
    setattr(sys.modules["matbench.scenes"], name, value)  # one warning is enough
    return value


sys.meta_path.append(Finder())
