"""What is checked, counted and timed are all built-in methods with all their presets, whoever adds one."""

import tomllib

import subjects
from places import ROOT

from matbench import parameters
from matbench.plans import plugins


def test_all_built_in_methods_and_presets_are_subjects() -> None:
    named = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["entry-points"]["matbench.algorithms"]
    wanted = set()
    for name in named:
        cls = plugins.algorithm(name).load()
        if not parameters.required(cls):
            wanted |= {name, *(f"{name}[preset={preset}]" for preset in parameters.presets_of(cls))}
    assert set(subjects.METHODS) == wanted, "install it again if an entry point is new: pip install -e '.[test]'"
    assert set(named) - wanted == {"command", "maps", "onnx"}, "what must be told something is timed by nobody"


def test_a_method_that_another_commit_lacks_costs_no_other(monkeypatch) -> None:

    import matbench.algorithms.sgbm

    before = subjects.METHODS
    monkeypatch.delattr(matbench.algorithms.sgbm, "SGBM")
    found = subjects._built_in()
    assert list(found) == list(before)
    assert type(found["sgbm"][0]).__name__ == "EntryPoint"
