"""Curves over a scene's option or a method's parameter: paired, averaged over what has every value."""

from collections.abc import Callable, Mapping

import numpy as np
import pandas as pd
import pytest

from matbench.measures.statistics import FEW, paired_effect
from matbench.plans.plan import Cell, Method, Plan
from matbench.results.sweeps import COLUMNS, Sweep, is_swept, sweeps, table
from matbench.spec import expand, parse, text

Score = Callable[[Method, str, Mapping[str, str]], float]


def method(name: str = "m", **params: int) -> Method:
    return Method(name, params, text({k: v for k, v in params.items() if v}))


def run(
    methods: list[Method], scenes: list[str], score: Score, seeds: tuple[int, ...] = (0,), **spellings: str
) -> tuple[Plan, pd.DataFrame]:
    """A plan and its results with one number per cell, from the method, the scene and its options."""
    names = [str(one) for one in expand(scenes)]
    cells = tuple(Cell(m, name, "", seed, "") for m in methods for name in names for seed in seeds)
    rows = []
    for cell in cells:
        (one,) = parse(cell.scene)
        value = score(cell.method, one.name, one.options) + cell.seed
        head = (cell.method.algorithm, cell.method.changed, cell.scene, "0", cell.seed)
        rows += [(*head, "all", "bad_1", value, "%", 900), (*head, "occ", "bad_1", 2 * value, "%", 400)]
    columns = ["algorithm", "params", "scene", "view", "seed", "region", "metric", "value", "unit", "pixels"]
    return Plan(cells, spellings=spellings), pd.DataFrame(rows, columns=columns)


def by_difficulty(method: Method, scene: str, options: Mapping[str, str]) -> float:
    """Scenes differ much, noise adds its square, method `b` is one better."""
    return 10.0 * int(scene[-1]) + float(options["noise"]) ** 2 - (method.algorithm == "b")


def curve(sweep: Sweep, algorithm: str = "m", region: str = "all", params: str = "") -> pd.DataFrame:
    found = sweep.curves
    mine = (found.algorithm == algorithm) & (found.params == params) & (found.region == region)
    return found[mine].set_index("value")


def test_a_scenes_option_gives_a_curve_for_each_method_and_region() -> None:
    (sweep,) = sweeps(*run([method("a"), method("b")], ["d/s0[noise=0,2,4]", "d/s1[noise=0,2,4]"], by_difficulty))
    assert (sweep.option, sweep.of, sweep.setting, sweep.values) == ("noise", "", "", (0, 2, 4))
    assert sweep.scenes == ("d/s0", "d/s1")
    assert curve(sweep, "a")["mean"].to_dict() == {0: 5, 2: 9, 4: 21}
    assert curve(sweep, "b", "occ")["mean"].to_dict() == {0: 8, 2: 16, 4: 40}
    assert curve(sweep, "a")["change"].to_list() == [0, 4, 16]
    assert (sweep.curves.scenes == 2).all()
    assert curve(sweep, "a")["verdict"].to_list() == ["", "too few scenes", "too few scenes"]
    assert sweep.curves[["low", "high"]].isna().all(axis=None), "two scenes have no band"


def test_enough_scenes_have_bands_and_paired_changes() -> None:
    noise = np.random.default_rng(0).normal(0, 1, (FEW, 5))
    scenes = [f"d/s{i}[noise=0,2,4]" for i in range(FEW)]

    def score(method: Method, scene: str, options: Mapping[str, str]) -> float:
        return by_difficulty(method, scene, options) + noise[int(scene[-1]), int(options["noise"])]

    (sweep,) = sweeps(*run([method("a")], scenes, score))
    at = curve(sweep, "a").loc[4.0]
    changes = [16 + noise[i, 4] - noise[i, 0] for i in range(FEW)]
    effect = paired_effect(changes)
    assert (at.change, at.change_low, at.change_high) == pytest.approx((effect.mean, effect.low, effect.high))
    whole = paired_effect([10 * i + 16 + noise[i, 4] for i in range(FEW)])
    assert (at["mean"], at.low, at.high) == pytest.approx((whole.mean, whole.low, whole.high))
    assert (at.verdict, at.scenes) == ("higher", FEW)


def test_a_scene_that_lacks_a_result_is_left_out_at_every_value() -> None:
    plan, results = run([method("a"), method("b")], ["d/s0[noise=0,2,4]", "d/s9[noise=0,2,4]"], by_difficulty)
    failed = (results.algorithm == "b") & (results.scene == "d/s9[noise=2]")
    (sweep,) = sweeps(plan, results[~failed])
    assert (sweep.scenes, sweep.left_out) == (("d/s0",), ("d/s9",))
    assert curve(sweep, "a")["mean"].to_dict() == {0: 0, 2: 4, 4: 16}
    (none,) = sweeps(plan, results.iloc[:0])
    assert (none.scenes, len(none.curves)) == ((), 0)


def test_a_region_that_is_empty_in_a_scene_counts_the_others() -> None:
    plan, results = run([method("a")], ["d/s0[noise=0,2,4]", "d/s9[noise=0,2,4]"], by_difficulty)
    results.loc[results.scene.str.startswith("d/s9") & (results.region == "occ"), "value"] = np.nan
    (sweep,) = sweeps(plan, results)
    assert curve(sweep, "a", "occ")["mean"].to_dict() == {0: 0, 2: 8, 4: 32}
    assert curve(sweep, "a", "occ")["scenes"].unique().tolist() == [1]
    assert curve(sweep, "a", "all")["scenes"].unique().tolist() == [2]


def test_scenes_with_fewer_values_are_compared_in_what_all_share() -> None:
    def score(method: Method, scene: str, options: Mapping[str, str]) -> float:
        return 100 * int(scene[-1]) + float(options["views"])

    plan, results = run([method("a")], ["d/s0[views=2,3,5]", "d/s1[views=2,3,5,7]", "d/s2[views=2,9]"], score)
    long, short = sweeps(plan, results)
    assert (long.values, long.scenes) == ((2, 3, 5, 7), ("d/s1",))
    assert (short.values, short.scenes) == ((2, 3, 5), ("d/s0", "d/s1"))
    assert curve(short, "a")["mean"].to_dict() == {2: 52, 3: 53, 5: 55}


def test_other_options_that_vary_are_settings_and_never_mixed() -> None:
    def score(method: Method, scene: str, options: Mapping[str, str]) -> float:
        return float(options["noise"]) * (10 if options.get("views") == "3" else 1)

    scenes = ["d/s0[noise=0,2,4 views=2,3]", "d/s1[noise=0,2,4 size=half views=3]"]
    two, three = sweeps(*run([method("a")], scenes, score))
    assert (two.setting, two.scenes) == ("views=2", ("d/s0",))
    # a size that a scene always has belongs to the scene
    assert (three.setting, three.scenes) == ("views=3", ("d/s0", "d/s1[size=half]"))
    assert curve(three, "a")["mean"].to_dict() == {0: 0, 2: 20, 4: 40}


def test_seeds_are_averaged_within_a_scene() -> None:
    def score(method: Method, scene: str, options: Mapping[str, str]) -> float:
        return float(options["noise"]) + 10 * float(options.get("seed", 0))

    scenes = ["d/s0[noise=0,2,4 seed=0,1,2,3]", "d/s1[noise=0,2,4]"]
    (sweep,) = sweeps(*run([method("a")], scenes, score, seeds=(0, 1)))
    assert sweep.scenes == ("d/s0", "d/s1")
    assert curve(sweep, "a")["mean"].to_list() == pytest.approx([8, 10, 12])  # mean of 15 and 0, and of the run's seeds


def test_a_methods_parameter_gives_a_curve_for_each_choice_of_the_others() -> None:
    def score(method: Method, scene: str, options: Mapping[str, str]) -> float:
        return method.params.get("window", 0) + 100 * method.params.get("fast", 0) + int(scene[-1])

    methods = [method(window=w, fast=f) for f in (0, 1) for w in (3, 5, 7)] + [method("other", window=3)]
    (sweep,) = sweeps(*run(methods, ["d/s0", "d/s4"], score))
    assert (sweep.option, sweep.of, sweep.values, sweep.scenes) == ("window", "m", (3, 5, 7), ("d/s0", "d/s4"))
    assert curve(sweep)["mean"].to_dict() == {3: 5, 5: 7, 7: 9}
    assert curve(sweep, params="fast=1")["mean"].to_dict() == {3: 105, 5: 107, 7: 109}
    assert set(sweep.curves.algorithm) == {"m"}


def test_a_scene_spelled_in_two_ways_has_both_values() -> None:
    def score(method: Method, scene: str, options: Mapping[str, str]) -> float:
        return float(options.get("noise", 1))

    plan, results = run([method("a")], ["d/s0", "d/s0[noise=0,4]"], score, **{"d/s0[noise=1]": "d/s0"})
    (sweep,) = sweeps(plan, results)
    assert curve(sweep, "a")["mean"].to_dict() == {0: 0, 1: 1, 4: 4}


@pytest.mark.parametrize(
    "scenes",
    [
        ["d/s0", "d/s1"],
        ["d/s0[noise=0,4]"],  # a switch
        ["d/s0[seed=0,1,2,3]"],
        ["d/s0[views=0:9:2,0:9:4,0:9]"],
        ["d/s0[noise=0]", "d/s1[noise=2]", "d/s2[noise=4]"],
    ],
)
def test_what_is_no_sweep(scenes: list[str]) -> None:
    assert sweeps(*run([method("a", flag=1), method("a", flag=2)], scenes, lambda *_: 1.0)) == []
    assert not is_swept(expand(scenes))


def test_names_that_are_no_selectors_are_scenes_all_the_same() -> None:
    plan, results = run([method(window=w) for w in (1, 2, 3)], ["d/s0"], lambda *_: 1.0)
    odd = Plan(tuple(Cell(c.method, "d/a b[", "", 0, "") for c in plan.cells))
    (sweep,) = sweeps(odd, results.assign(scene="d/a b["))
    assert sweep.scenes == ('"d/a b["',), "as it would be asked for"


def test_patterns_that_sweep_are_known_before_anything_runs() -> None:
    assert is_swept(expand("m*/*[noise=0,2,4]"))
    assert is_swept(expand(["a/b[views=2,3]", "a/b[views=7]"]))


def test_regions_that_move_and_methods_that_use_less_are_named() -> None:
    methods = [method("a", views=5), method("b", views=0), method("c", views=9)]
    plan, results = run(methods, ["d/s0[views=3,5,9]"], lambda *_: 1.0)
    results.loc[(results.region == "occ") & (results.scene == "d/s0[views=9]"), "pixels"] = 500
    (sweep,) = sweeps(plan, results)
    assert sweep.moving == ("occ",)
    assert dict(sweep.limits) == {"a[views=5]": 5}


def test_metrics_over_different_pixels_move_no_region() -> None:
    """A prediction counts the pixels of another view."""
    plan, results = run([method()], ["d/s0[noise=0,2,4]"], by_difficulty)
    predicted = results[results["region"] == "all"].assign(metric="prediction_psnr", unit="dB", pixels=8)
    (sweep,) = sweeps(plan, pd.concat([results, predicted]))
    assert sweep.moving == ()
    assert set(sweep.curves["metric"]) == {"bad_1", "prediction_psnr"}


def test_the_table_holds_every_curve() -> None:
    plan, results = run([method(window=w) for w in (3, 5, 7)], ["d/s0[noise=0,2,4]"], by_difficulty)
    found = sweeps(plan, results)
    assert [(s.option, s.setting) for s in found] == [
        ("noise", ""),
        ("window", "noise=0"),
        ("window", "noise=2"),
        ("window", "noise=4"),
    ]
    whole = table(found)
    assert list(whole.columns) == ["option", "of", "setting", "values", *COLUMNS, "over"]
    assert len(whole) == 2 * 9 * 2
    assert set(whole["values"]) == {"0 2 4", "3 5 7"}
    assert table([]).empty
