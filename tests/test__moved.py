"""Old names of modules, and of what is in them: they are found, with a warning."""

import sys
import warnings
from importlib import import_module

import pytest

import matbench
from matbench import _moved

LISTED = [
    *("ablation", "archive", "cluster", "contract", "dataset", "keeper", "metrics", "plan", "prediction", "run"),
    *("settings", "statistics", "store", "sweeps", "volume_metrics"),
]
"""Modules that the reference listed before they moved."""


@pytest.mark.parametrize("name", LISTED)
def test_an_old_name_is_the_new_module_with_a_warning(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    old, new = f"matbench.{name}", _moved.MODULES[f"matbench.{name}"]
    monkeypatch.delitem(sys.modules, old, raising=False)
    with pytest.warns(DeprecationWarning, match=f"{old} has moved: import {new}"):
        found = import_module(old)
    assert found is import_module(new)
    assert found.__spec__ is not None
    assert found.__spec__.name == new
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert import_module(old) is found


@pytest.mark.parametrize(
    ("module", "name"), [(module, name) for module, names in _moved.NAMES.items() for name in names]
)
def test_a_name_that_is_elsewhere_now_is_found_where_it_was(module: str, name: str) -> None:
    home, _, now = _moved.NAMES[module][name].rpartition(".")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the module, once a process
        vars(import_module(module)).pop(name, None)
    with pytest.warns(DeprecationWarning, match=rf"{module}\.{name} has moved: import {home}\.{now}") as told:
        found = getattr(import_module(module), name)
    assert found is getattr(import_module(home), now)
    assert told[-1].filename == __file__, "whoever uses it is warned"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert getattr(import_module(module), name) is found


def test_other_names_are_as_unknown_as_ever() -> None:
    with pytest.raises(ModuleNotFoundError, match=r"matbench\.meterics"):
        import_module("matbench.meterics")
    with pytest.raises(ImportError, match="load_scenes"):
        exec("from matbench.scenes import load_scenes")  # noqa: S102
    with pytest.raises(ImportError, match="flatten"):
        exec("from matbench.spec import flatten")  # noqa: S102


def test_a_plug_in_written_before_the_move_works(tmp_path) -> None:
    (tmp_path / "old.py").write_text(
        "from matbench.metrics import Metric\n"
        "from matbench.spec import flat\n"
        "from matbench.store import FINAL\n"
        "from matbench.scenes import load_scene\n"
        "from matbench import Estimate\n"
        "import numpy as np\n"
        "@flat\n"
        "class Old:\n"
        "    def solve(self, scene, context):\n"
        "        return Estimate({scene.ref: np.zeros((scene.height, scene.width), np.float32)})\n"
        "M = Metric('worst', 'px', 'lower', 'largest error', lambda errors: float(np.nanmax(errors)))\n"
    )
    table = matbench.compare("old", "synthetic/box[size=48x36]", plugin=tmp_path / "old.py", out=tmp_path / "run")
    assert (table[table["metric"] == "worst"]["value"].max()) > 1


def test_what_scripts_give_to_compare_is_found_under_its_old_name(monkeypatch: pytest.MonkeyPatch) -> None:
    from matbench.plans.record_option import RecordOption

    monkeypatch.delitem(sys.modules, "matbench.recorded", raising=False)
    with pytest.warns(DeprecationWarning, match=r"matbench\.recorded has moved"):
        assert import_module("matbench.recorded").Recording is RecordOption
