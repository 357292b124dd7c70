"""Ranks and differences of methods."""

import numpy as np
import pandas as pd
import pytest
from attrs import evolve

from matbench.measures.statistics import FEW, Effect
from matbench.reports import standing, tables
from matbench.reports.content import Report


def test_standings_are_over_distinct_scenes_and_ranked_methods(report: Report) -> None:
    scope = tables.shared(report.results, report.cells)
    table = tables.per_scene(report.results, "all", "total_bad_1")
    ranks = standing.mean_ranks(table, scope, "%", "lower")
    assert list(ranks.values())[:2] == [1, 2]
    assert np.isnan(list(ranks.values())[2])
    assert list(standing.mean_ranks(table, scope, "%", "higher").values())[:2] == [2, 1]
    centred = table - table.iloc[:, :2].to_numpy().max()  # the larger is nearer to zero
    assert list(standing.mean_ranks(centred, scope, "%", "zero").values())[:2] == [2, 1]
    ((found,),) = standing.differences([table], scope)
    assert (found.effect.mean, found.effect.scenes) == (pytest.approx(10), 2)
    guises = {s: f"made/one[noise={k}]" for k, s in enumerate(scope.asked)}
    renamed = evolve(
        scope,
        asked=tuple(guises.values()),
        scenes=tuple(guises.values()),
        has={m: frozenset(guises[s] for s in has) for m, has in scope.has.items()},
    )
    ((one,),) = standing.differences([table.rename(index=guises)], renamed)
    assert (one.effect.mean, one.effect.scenes) == (pytest.approx(10), 1)


def test_an_effect_is_turned_with_its_interval() -> None:
    assert standing.turned(Effect(2.0, 1.0, 4.0, 0.5, 6, 0.3)) == Effect(-2.0, -4.0, -1.0, -0.5, 6, 0.3)
    assert standing.words("lower", higher=False) == standing.words("higher", higher=True) == "better"
    assert standing.words("too few scenes", higher=True) == "too few scenes"


def test_what_is_undecided_says_how_many_scenes_would_decide() -> None:
    assert standing.verdict("undecided", 1234.0).startswith("undecided: about 1200 scenes")
    assert standing.verdict("undecided", float("nan")) == standing.verdict("undecided", None) == "undecided"
    assert standing.verdict("lower", 23.0) == "lower"


def scores(shift: float, scenes: int = 12, methods: int = 4) -> tuple[pd.DataFrame, tables.Shared]:
    """Scenes x methods, of which each is worse by `shift` than the one before, with noise of 1."""
    names, draw = [f"d/s{i}" for i in range(scenes)], np.random.default_rng(0)
    columns = [f"m{j}" for j in range(methods)]
    values = draw.normal(5, 1, (scenes, methods)) + shift * np.arange(methods)
    has = dict.fromkeys(columns, frozenset(names))
    table = pd.DataFrame(values.round(2), names, columns)
    return table, tables.Shared(tuple(columns), tuple(names), has, tuple(names))


def test_all_differences_of_a_table_are_judged_beside_each_other() -> None:
    (found,) = standing.differences([scores(1.0)[0]], scores(1.0)[1])
    assert len(found) == 6
    assert min(d.effect.level for d in found) == pytest.approx(0.05 / 6)
    assert {d.effect.verdict for d in found if d.method == "m3" and d.reference == "m0"} == {"higher"}
    assert "6 differences between 4 methods" in standing.correction(4)
    many = standing.REFERENCES + 2
    table, scope = scores(0.0, methods=many)
    assert f"{len(standing.differences([table], scope)[0])} differences" in standing.correction(many)


def test_the_critical_difference_is_demsars() -> None:
    """His example: four methods on 14 data sets have 1.25 (section 3.2.2)."""
    table, scope = scores(0.0, 14)
    found = standing.ranking(table, scope, "%", "lower")
    assert found is not None
    assert found.critical == pytest.approx(1.25, abs=0.005)
    assert found.p > 0.05
    assert list(found.means.values()) == sorted(found.means.values())
    assert found.alike == [tuple(found.means)]


def test_methods_far_apart_share_no_bar() -> None:
    found = standing.ranking(*scores(9.0, 40), "%", "lower")
    assert found is not None
    assert found.p < 1e-6
    assert list(found.means.items()) == [("m0", 1), ("m1", 2), ("m2", 3), ("m3", 4)]
    assert found.critical < 1
    assert found.alike == []
    assert evolve(found, critical=1.5).alike == [("m0", "m1"), ("m1", "m2"), ("m2", "m3")]
    assert evolve(found, critical=2.5).alike == [("m0", "m1", "m2"), ("m1", "m2", "m3")]


def test_few_scenes_or_methods_have_no_critical_difference() -> None:
    assert standing.ranking(*scores(1.0, FEW - 1), "%", "lower") is None
    assert standing.ranking(*scores(1.0, methods=2), "%", "lower") is None
    table, scope = scores(0.0)
    same = standing.ranking(table * 0, scope, "%", "lower")
    assert same is not None
    assert same.p == 1
