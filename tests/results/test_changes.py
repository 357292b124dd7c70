"""What has changed since an earlier run, against sums done by hand."""

from math import nan

import pandas as pd
import pytest

from matbench.plans.plan import Cell, Method, Plan
from matbench.results.changes import COLUMNS, EFFECT_COLUMNS, UNCHANGED, changes, effects, paired
from matbench.results.comparable import SILENT

SCENES = [f"made/{name}" for name in "abcdefg"]
MINE = Method("mine", {"window": 5}, "", "1")


def plan(*methods: Method) -> Plan:
    return Plan(tuple(Cell(method, "made/a", "", 0, f"{n:016}") for n, method in enumerate(methods)))


def table(values: dict[str, list[float]], metric: str = "bad_1", answered: float = 100.0) -> pd.DataFrame:
    """Method -> a value for each scene, in `all`."""
    rows = [
        (method, "", scene, 0, "all", metric, value, "%", 1000, answered)
        for method, numbers in values.items()
        for scene, value in zip(SCENES, numbers, strict=False)
    ]
    names = ["algorithm", "params", "scene", "seed", "region", "metric", "value", "unit", "pixels", "answered"]
    return pd.DataFrame(rows, columns=names)


def test_methods_are_paired_by_name_or_by_what_they_are() -> None:
    other = Method("mine", {"window": 7}, "window=7", "1")
    labelled = Method("mine", {"window": 5}, "", "2", label="after")
    grown = Method("mine", {"window": 5, "new": 1}, "", "2")
    assert paired(plan(labelled), plan(other, MINE)) == {("after", ""): ("mine", "")}
    assert paired(plan(grown), plan(MINE)) == {("mine", ""): ("mine", "")}, "a new parameter is no other method"
    assert paired(plan(other), plan(MINE)) == {}
    both = paired(plan(MINE, labelled), plan(MINE))
    assert both == {("mine", ""): ("mine", ""), ("after", ""): ("mine", "")}, "two versions, one before"


def test_changes_are_cell_by_cell_and_effects_over_scenes() -> None:
    before = table({"old": [10, 20, 30, 40, 50, 60, 70]})
    now = table({"new": [9, 18, 30, 39, 48, 60, 69], "else": [1] * 7})
    found = changes(now, before, {("new", ""): ("old", "")})
    assert tuple(found.columns) == COLUMNS
    assert found["change"].to_list() == [-1, -2, 0, -1, -2, 0, -1]
    assert found["before"].to_list() == [10, 20, 30, 40, 50, 60, 70]
    assert set(found["algorithm"]) == {"new"}
    (effect,) = effects(found, {}).to_dict("records")
    assert tuple(effect) == EFFECT_COLUMNS
    assert effect["change"] == pytest.approx(-1)
    assert effect["low"] < -1 < effect["high"] < 0
    assert (effect["scenes"], effect["verdict"]) == (7, "lower")


def test_what_is_the_same_is_unchanged_on_one_scene_too() -> None:
    one = table({"mine": [10.5]})
    (effect,) = effects(changes(one, one, {("mine", ""): ("mine", "")}), {}).to_dict("records")
    assert (effect["change"], effect["scenes"], effect["verdict"]) == (0, 1, UNCHANGED)


def test_scenes_that_only_one_run_has_are_left_out_and_lost_scores_say_nothing() -> None:
    now, before = table({"mine": [1, nan, 3]}), table({"mine": [2, 2, 2, 2]})
    found = changes(now, before, {("mine", ""): ("mine", "")})
    assert found["scene"].to_list() == SCENES[:3]
    (effect,) = effects(found, {}).to_dict("records")
    assert effect["change"] == pytest.approx(0)
    assert effect["scenes"] == 2
    assert effect["verdict"] == "too few scenes", "they cancel, but they have changed"


def test_options_and_seeds_of_a_scene_are_one_witness() -> None:
    now = table({"mine": [1, 3]}).assign(scene=["made/a[noise=1]", "made/a[noise=2]"])
    before = now.assign(value=[0, 0])
    (effect,) = effects(changes(now, before, {("mine", ""): ("mine", "")}), {}).to_dict("records")
    assert (effect["change"], effect["scenes"]) == (2, 1)


def test_a_signed_metric_changes_by_its_magnitude_and_silence_is_no_gain() -> None:
    pairs = {("mine", ""): ("mine", "")}
    now, before = table({"mine": [-1] * 7}, "bias"), table({"mine": [3] * 7}, "bias")
    (effect,) = effects(changes(now, before, pairs), {"bias": "zero"}).to_dict("records")
    assert effect["change"] == -2
    quiet = table({"mine": [0.1 * n for n in range(7)]}, answered=50.0)
    (effect,) = effects(changes(quiet, table({"mine": [5] * 7}), pairs), {}).to_dict("records")
    assert effect["verdict"] == SILENT


def test_nothing_in_common_is_an_empty_table() -> None:
    found = changes(table({"mine": [1]}), table({"mine": [1]}), {})
    assert found.empty
    assert effects(found, {}).empty
