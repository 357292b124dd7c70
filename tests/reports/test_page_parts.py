"""What the page is made of: maps that can be read back, slices, spreads of errors, standings."""

import re
from base64 import b64decode

import cv2
import numpy as np
import pandas as pd
import pytest
from attrs import evolve
from numpy.typing import NDArray
from scipy.stats import bootstrap

from matbench.measures.metrics import total_bad
from matbench.measures.statistics import Effect, intervals, paired_effect, paired_effects
from matbench.measures.volumes import StoredVolume
from matbench.regions import view_regions
from matbench.reports import costs, error_spread, page, page_slices, passes, pictures, standing, tables
from matbench.reports.content import Report
from matbench.reports.encoding import FINER, LEAST_SIDE, Coding, photograph, side_for
from matbench.reports.numbers import Numbers
from matbench.scenes.catalogue import load_scene
from matbench.space import DisparitySpace, Volume, surface, visibility


def read(uri: str) -> NDArray[np.uint8]:
    found = cv2.imdecode(np.frombuffer(b64decode(uri.partition(",")[2]), np.uint8), cv2.IMREAD_UNCHANGED)
    assert found is not None
    return found.astype(np.uint8)


@pytest.mark.parametrize("span", [3.0, 60.0, 254.5, 700.0])
def test_a_map_is_read_back_within_half_a_step(report: Report, span: float) -> None:
    scene = next(iter(report.scenes.values()))
    random = np.random.default_rng(0)
    values = random.uniform(0, span, (40, 50)).astype(np.float32)
    values[:3] = np.nan
    coding = Coding.of(evolve(scene, disparities=type(scene.disparities)(0, span), truth={}, regions={}))
    rows = read(coding.encode(values, 2.0, 512))
    assert rows.shape == (80, 50)
    coarse, fine = rows[:40].astype(float), rows[40:].astype(float)
    found = np.where(coarse > 0, coding.low + coding.step * (FINER * (coarse / coding.gain - 1) + fine), np.nan)
    assert np.array_equal(np.isnan(found), np.isnan(values))
    assert np.nanmax(np.abs(found - 2 * values.astype(np.float64))) <= coding.step / 2 + 1e-4
    assert coding.step <= max(0.125, (2 * span + 8) / 2000)


def test_pictures_are_bounded() -> None:
    assert read(photograph(np.zeros((300, 1024, 3), np.uint8), 512)).shape == (150, 512, 3)
    assert side_for(1) == 1024
    assert side_for(10 * 14) > 512, "ten methods on ten scenes of quarter size"
    assert side_for(10**6) == 160


def test_pictures_that_do_not_compress_are_drawn_smaller_until_the_page_holds_them(report: Report) -> None:
    template, random = next(iter(report.scenes.values())), np.random.default_rng(0)
    views = random.integers(0, 255, (3, 150, 200, 3), dtype=np.uint8)
    truth = random.uniform(0, 5, (150, 200)).astype(np.float32)
    noisy = evolve(template, views=views, truth={1: truth}, regions={"all": np.isfinite(truth)})
    maps = {key: random.uniform(0, 5, (150, 200)).astype(np.float32) for key in report.maps}
    made = evolve(
        report, maps=maps, scenes=dict.fromkeys(report.scenes, noisy), results=tables.labelled(report.results)
    )
    made = evolve(made, cells=tables.labelled(report.cells))
    scope = tables.shared(made.results, made.cells)
    whole = pictures.gallery(made, scope)
    assert whole.scenes[0]["shown"] == (200, 150)
    fitting = pictures.gallery(made, scope, whole.characters // 3)
    assert whole.characters / 5 < fitting.characters <= whole.characters // 3
    columns, rows = fitting.scenes[0]["shown"]
    assert read(fitting.scenes[0]["methods"][0]["map"]).shape == (2 * rows, columns)
    assert fitting.spreads.keys() == whole.spreads.keys()
    least = pictures.gallery(made, scope, 1)
    assert least.scenes[0]["shown"] == (LEAST_SIDE, 48), "not smaller than can be seen"


def test_similarity_is_highest_at_the_truth() -> None:
    scene = load_scene("synthetic/box")
    row = scene.height // 2
    found = page_slices.similarity(scene, row)
    low, high = found.ends
    planes = np.linspace(high, low, 2 * len(found.values) + 1)[1::2]
    seen = scene.scored_regions["seen_in_all"][row]
    best = planes[found.values.argmax(axis=0)]
    step = planes[0] - planes[1]
    near = np.abs(best - scene.truth[scene.ref][row]) <= step
    assert near[seen].mean() > 0.9
    outside = page_slices.similarity(
        evolve(scene, views=np.zeros_like(scene.views), truth={}, regions={}, visible={}), row
    )
    assert outside.values[:, scene.width // 2].min() == 255, "all black is all alike"


def test_a_row_of_a_volume_is_that_of_the_whole_volume() -> None:
    scene = load_scene("synthetic/box[n=4]")
    space = DisparitySpace.covering(scene.disparities, 3, scene.height, scene.width, 2)
    random = np.random.default_rng(0)
    volume = Volume(space, random.integers(0, 256, space.shape).astype(np.float32) / 255, (0, 1, 2))
    stored = StoredVolume.of(volume)
    row, ref = 17, scene.ref
    found = page_slices.materiality(stored, scene, row)
    assert found is not None
    material, sight = found
    assert np.array_equal(material.values[::-1], space.in_view(stored.levels, ref)[row])
    share = np.mean([space.in_view(visibility(volume, v), ref)[row] for v in range(3)], axis=0)
    assert np.abs(sight.values[::-1].astype(float) - 255 * share).max() <= 1
    assert material.ends == ((space.first - 0.5) / 2, (space.last + 0.5) / 2)
    assert page_slices.materiality(evolve(stored, views=(1, 2, 3)), evolve(scene, ref=0), row) is None


def test_the_slice_of_a_known_surface_lies_at_its_disparity() -> None:
    scene = load_scene("synthetic/box")
    truth = scene.truth[scene.ref]
    space = DisparitySpace.covering(scene.disparities, scene.n, scene.height, scene.width)
    stored = StoredVolume.of(surface(space, {scene.ref: truth}, tuple(range(scene.n))))
    found = page_slices.materiality(stored, scene, 90)
    assert found is not None
    low, high = found[0].ends
    top = np.argmax(found[0].values > 127, axis=0)
    disparity = high - (top + 0.5) * (high - low) / len(found[0].values)
    assert np.abs(disparity - truth[90]).max() <= 0.5 + 1e-6


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


def test_intervals_are_those_of_scipy() -> None:
    values = np.sort(np.random.default_rng(3).normal(4, 2, (3, 9)))  # in the order and sign in which they are drawn
    wanted = bootstrap((values,), np.mean, axis=-1, n_resamples=4999, method="percentile", batch=256, rng=0)
    low, high = intervals(values)
    assert low == pytest.approx(wanted.confidence_interval.low)
    assert high == pytest.approx(wanted.confidence_interval.high)


def test_many_effects_are_each_its_own() -> None:
    rows = [[1.0, 2, 4, 3, 5, 2.5], [0.5], [], [1, np.nan, 2], [2.0, 2.0], [0.0, 0.0]]
    for row, found in zip(rows, paired_effects(rows), strict=True):
        alone = paired_effect(row)
        assert np.array_equal(
            [found.mean, found.low, found.high, found.size, found.scenes],
            [alone.mean, alone.low, alone.high, alone.size, alone.scenes],
            equal_nan=True,
        )
    assert paired_effects(rows)[4] == Effect(2, 2, 2, float("inf"), 2)


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


def test_all_tables_at_once_are_those_made_alone(report: Report) -> None:
    again = pd.concat([report.results, report.results.iloc[:40].assign(seed=1, value=np.nan)])
    for (metric, region), table in tables.every_scene(again).items():
        pd.testing.assert_frame_equal(table, tables.per_scene(again, region, metric), check_names=False)


def test_costs_are_those_of_the_printed_tables(report: Report) -> None:
    company = report.cells.assign(alone=[True, True, True, False, True, None], machine="a")
    rows = tables.summary(report.results, company)
    labelled = evolve(report, results=tables.labelled(report.results), cells=tables.labelled(company))
    made = Numbers(labelled, tables.shared(report.results, company))
    shown = {m: seconds for m, (seconds, *_) in made.costs["seconds"].items()}
    assert shown == {m: None if np.isnan(v) else v for m, v in rows["seconds"].items()}
    assert shown["good"] == 0.5
    marked = [entry for entry in made.costs["seconds"].values() if "not ranked" in entry[3:]]
    assert [entry[:3] for entry in marked] == [[1.5, "1.50", tables.NOT_RANKED]], "one ran while others did"
    assert made.costs["peak_mb"]["good"][:2] == [100, "100"]
    html = page.render(evolve(report, cells=company))
    note = costs.timing_note(company)
    assert f"{note[0].upper()}{note[1:]}" in html
    assert "not alone" not in page.render(report)


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


def test_energies_are_drawn_relative_to_their_first_pass(report: Report) -> None:
    scope = tables.shared(report.results, report.cells)
    assert passes.energies(report, scope) is None
    names = [("good", "", name, 0) for name in scope.asked]
    told = evolve(
        report, histories={names[0]: {"total": [4.0, 2.0, 1.0], "once": [3.0]}, names[1]: {"total": [8, None, 6]}}
    )
    figure = passes.energies(told, scope)
    assert figure is not None
    assert list(figure.axes[0].get_lines()[0].get_ydata()) == [100, 50, 25]
    assert passes.lines(told, scope) == [["good", "total", "2", "3", "-50.0"]]
    assert "No method told" in page.render(report)
    assert "No method told" not in page.render(told)


def test_parameters_stand_in_their_groups(report: Report) -> None:
    names = str(report.cells["algorithm"].iloc[0]), str(report.cells["params"].fillna("").iloc[0])
    one = evolve(
        report,
        parameters={names: {"passes": 1, "window": 5, "fill": True}},
        groups={names[0]: {"passes": "fixed_point", "window": "matching"}},
    )
    told = page.render(one).partition("<summary>all parameters</summary>")[2].partition("</details>")[0]
    assert re.sub("</?(p|code)>", "", told).split() == [
        "fill=True",
        "fixed",
        "point:",
        "passes=1",
        "matching:",
        "window=5",
    ]
