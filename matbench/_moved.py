"""Old names of modules and of what is in them: plug-ins of others go on importing them, and are warned."""

import sys
import warnings
from functools import partial
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

NAMES = {
    "matbench.cluster": {"Keepers": "matbench.solving.cluster_worker.Keepers"},
    "matbench.contract": {
        "Finding": "matbench.solving.check_verdicts.CheckResult",
        "Trial": "matbench.solving.check_scenes.Trial",
        "Verdict": "matbench.solving.check_verdicts.Verdict",
        "mirrored": "matbench.solving.check_scenes.mirrored",
    },
    "matbench.keeper": {
        "Child": "matbench.solving.child.Child",
        "Dismissed": "matbench.solving.keeper_process.Dismissed",
    },
    "matbench.reports.paper_figure": {"look": "matbench.reports.paper_figure.small_print"},
    "matbench.scenes": {
        name: f"matbench.scenes.catalogue.{name}" for name in ("data_root", "listings", "load_scene", "select")
    },
    "matbench.spec": {name: f"matbench.parameters.{name}" for name in ("build", "flat")},
    "matbench.store": {
        "FINAL": "matbench.runs.outcome.FINAL",
        "FolderLost": "matbench.runs.stopped.FolderLost",
        "Status": "matbench.runs.outcome.Status",
    },
}
"""Module under the name that was documented -> what was in it, and is elsewhere now or has another name."""


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
        new = import_module(MODULES[module.__name__])
        if module.__name__ in NAMES:
            vars(new).setdefault("__getattr__", partial(moved_name, module.__name__))
        sys.modules[module.__name__] = new


def moved_name(module: str, name: str) -> Any:
    """One of `NAMES` of a module.

    Raises
    ------
    AttributeError
        For any other name.
    """
    if name not in NAMES[module]:
        raise AttributeError(f"module {module!r} has no attribute {name!r}")
    home, _, now = NAMES[module][name].rpartition(".")
    _warn(f"{module}.{name}", f"{home}.{now}", 2)
    value = getattr(import_module(home), now)
    setattr(sys.modules[module], name, value)  # one warning is enough
    return value


sys.meta_path.append(Finder())
