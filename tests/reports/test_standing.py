"""Ranks and differences of methods."""

import numpy as np
import pytest
from attrs import evolve

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
