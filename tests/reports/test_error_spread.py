"""How errors spread: by threshold and by the views that see a point."""

import numpy as np
import pandas as pd
import pytest

from matbench.measures.metrics import total_bad
from matbench.regions import view_regions
from matbench.reports import error_spread, tables
from matbench.scenes.catalogue import load_scene


def test_spreads_are_the_scores() -> None:
    scene = load_scene("synthetic/box")
    truth, random = scene.truth[scene.ref], np.random.default_rng(0)
    estimate = (truth + random.normal(0, 0.5, truth.shape)).astype(np.float32)
    estimate[::5] = np.nan
    seeing = error_spread.views_seeing(scene)
    assert seeing is not None
    found = error_spread.spread(estimate, scene, seeing)
    error = np.abs(estimate.astype(np.float64) - truth.astype(np.float64)) * scene.pair_steps
    for region, mask in scene.scored_regions.items():
        for at, threshold in enumerate(error_spread.THRESHOLDS):
            if mask.any():
                assert found.above[region][at] == pytest.approx(total_bad(error[mask], threshold))
    parts = view_regions(truth, scene.ref, scene.n, scene.visible.get(scene.ref))
    assert np.array_equal(seeing == scene.n, parts["seen_in_all"])
    assert np.array_equal(seeing == 1, parts["seen_once"])
    assert found.by_views[scene.n] == pytest.approx(total_bad(error[seeing == scene.n], 1))


def test_curves_against_the_threshold_go_through_the_tables_means() -> None:
    scenes = ("a[noise=0]", "a[noise=9]", "b")
    scope = tables.Shared(("m",), scenes, {"m": frozenset(scenes)}, scenes)
    size = len(error_spread.THRESHOLDS)
    spreads = {
        ("m", s): error_spread.Spread({"all": np.full(size, v)}, {1: v}, 2)
        for s, v in zip(scenes, (10.0, 20.0, 60.0), strict=True)
    }
    table = pd.DataFrame({"m": [10.0, 20.0, 60.0]}, index=list(scenes))
    (mean,) = tables.over_scenes(table, scope)
    for figure in (error_spread.thresholds(spreads, scope), error_spread.by_views(spreads, scope)[0]):
        assert figure is not None
        assert set(figure.axes[0].lines[0].get_ydata()) == {mean}
