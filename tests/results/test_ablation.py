"""Paired differences, their intervals, and what a factor is said to do."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from matbench.errors import UserError
from matbench.measures.statistics import FEW, paired_effect
from matbench.plans.plan import Cell, Method, Plan
from matbench.results.ablation import ablation, check_varies


def test_an_effect_is_the_mean_its_interval_and_its_size() -> None:
    differences = np.random.default_rng(0).normal(-2, 1, 40)
    effect = paired_effect(list(differences))
    assert effect.mean == pytest.approx(differences.mean())
    assert effect.size == pytest.approx(differences.mean() / differences.std(ddof=1))
    half = 1.96 * differences.std(ddof=1) / np.sqrt(40)
    assert effect.low == pytest.approx(differences.mean() - half, abs=0.1)
    assert effect.high == pytest.approx(differences.mean() + half, abs=0.1)
    assert effect.verdict == "lower"
    assert paired_effect(list(-differences)).verdict == "higher"
    assert paired_effect(list(differences)) == effect  # seeded


def test_few_scenes_carry_no_conclusion_however_clear() -> None:
    assert paired_effect([-1.0] * (FEW - 1)).verdict == "too few scenes"
    assert paired_effect([-1.0] * FEW).verdict == "lower"


@pytest.mark.parametrize("differences", [[], [1.0], [float("nan"), 1.0]])
def test_less_than_two_scenes_have_no_interval(differences: list[float]) -> None:
    effect = paired_effect(differences)
    assert np.isnan(effect.low)
    assert np.isnan(effect.size)
    assert effect.verdict == "too few scenes"


def test_the_interval_covers_the_truth_about_as_often_as_it_says() -> None:
    rng = np.random.default_rng(1)
    effects = [paired_effect(list(rng.normal(1, 2, 30))) for _ in range(200)]
    assert 0.88 <= np.mean([e.low <= 1 <= e.high for e in effects]) <= 0.99


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(-100, 100), min_size=2, max_size=12))
def test_the_mean_lies_within_its_interval(differences: list[float]) -> None:
    effect = paired_effect(differences)
    assert effect.low - 1e-9 <= effect.mean <= effect.high + 1e-9


def run(methods: list[Method], value: "dict[tuple[str, str], float]") -> tuple[Plan, pd.DataFrame]:
    """A plan and its results with one number per method and scene."""
    scenes = [f"s{i}" for i in range(8)]
    cells = tuple(Cell(m, scene, "", 0, "") for m in methods for scene in scenes)
    rows = [
        (m.algorithm, m.changed, scene, "0", 0, "all", "bad_1", value[m.changed, scene], "%", 9)
        for m in methods
        for scene in scenes
    ]
    columns = ["algorithm", "params", "scene", "view", "seed", "region", "metric", "value", "unit", "pixels"]
    return Plan(cells), pd.DataFrame(rows, columns=columns)


def method(pairs: str, window: int) -> Method:
    return Method("m", {"pairs": pairs, "window": window, "fixed": 1}, f"pairs={pairs} window={window}")


def test_each_factor_is_judged_with_all_else_equal() -> None:
    methods = [method(pairs, window) for pairs in ("all", "some") for window in (3, 5)]
    # a scene's own difficulty is large; `some` costs 2, window 5 gains 1, and they do not interact
    value = {
        (m.changed, f"s{i}"): 10.0 * i
        + 2 * (m.params["pairs"] == "some")
        - (m.params["window"] == 5)
        + 0.01 * i * (m.params["pairs"] == "some")
        for m in methods
        for i in range(8)
    }
    table = ablation(*run(methods, value)).set_index("factor")
    assert set(table.index) == {"pairs", "window"}
    assert table.loc["pairs", "change"] == pytest.approx(2.035)
    assert (table.loc["pairs", ["base", "level", "verdict", "scenes"]] == ["all", "some", "higher", 8]).all()
    assert table.loc["window", "change"] == pytest.approx(-1)
    assert table.loc["window", "verdict"] == "lower"


def test_a_failed_combination_leaves_its_partner_out() -> None:
    methods = [method("all", 3), method("some", 3)]
    plan, results = run(methods, {(m.changed, f"s{i}"): float(i) for m in methods for i in range(8)})
    kept = results[~((results.params == methods[1].changed) & (results.scene == "s7"))]
    assert ablation(plan, kept).scenes.item() == 7


def test_a_scene_in_several_guises_is_one_scene() -> None:
    methods = [method("all", 3), method("some", 3)]
    plan, results = run(methods, {(m.changed, f"s{i}"): float(i * len(m.changed)) for m in methods for i in range(8)})
    guises = {f"s{i}": f"s{i % 4}[noise={i // 4}]" for i in range(8)}
    effect = ablation(plan, results.assign(scene=results.scene.map(guises)))
    plain = ablation(plan, results)
    assert (effect.scenes.item(), plain.scenes.item()) == (4, 8)
    assert effect.change.item() == pytest.approx(plain.change.item())
    assert effect.verdict.item() == "too few scenes"


def test_nothing_to_ablate_is_said() -> None:
    with pytest.raises(UserError, match="nothing varies"):
        check_varies([method("all", 3)], ["synthetic/box[noise=0,4]"])
    check_varies([method("all", 3), method("some", 3)], [])
    check_varies([method("all", 3)], ["synthetic/box[noise=0,4,8]"])


@pytest.mark.parametrize("cells", [0, 1])
def test_what_an_early_interruption_leaves_tells_no_effect(cells: int) -> None:
    methods = [method("all", 3), method("some", 3)]
    plan, results = run(methods, {(m.changed, f"s{i}"): float(i) for m in methods for i in range(8)})
    assert ablation(plan, results[:cells]).empty
