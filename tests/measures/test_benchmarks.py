"""The benchmarks' metrics, each against a slow twin of it."""

from collections.abc import Callable
from math import isnan, nan, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from matbench.errors import UserError
from matbench.measures.benchmarks import BAD, METRICS, QUANTILES, SETS, TOTAL_BAD, bumps, set_named
from matbench.measures.metrics import MapInRegion, Metric, map_in_region, score
from matbench.results import metric_catalogue
from matbench.scene import Range, Scene

OWN = tuple(metric for metric in METRICS if isinstance(metric, Metric))
STEPS = 2.0


def scene_of(truth: NDArray[np.float32]) -> Scene:
    views = np.zeros((3, *truth.shape, 3), np.uint8)
    return Scene("made/up", views, ("0", "1", "2"), 1, Range(-9, 9), {1: truth}, STEPS)


def made(seed: int, size: tuple[int, int] = (9, 11)) -> tuple[Scene, NDArray[np.float32], NDArray[np.bool_]]:
    """A scene with holes in its truth, an estimate with holes, and a region."""
    random = np.random.default_rng(seed)
    truth = random.uniform(-40, 40, size).astype(np.float32)
    estimate = (truth + random.choice([0, 0.01, 0.05, -0.1, 1.5, -3], size)).astype(np.float32)
    truth[random.random(size) < 0.05] = np.nan
    estimate[random.random(size) < 0.05] = np.nan
    return scene_of(truth), estimate, random.random(size) < 0.8


def found(metric: Metric, scene: Scene, estimate: NDArray[np.float32], mask: NDArray[np.bool_]) -> float:
    return score(estimate, scene.truth[1], mask, STEPS, [metric], scene)[metric.name]


# the twins: a pixel at a time, errors and truths of the region in px of the pair

Pixels = list[tuple[float, float]]  # signed error, nan for no answer, and truth
TIE = 1e-4


def share(hits: list[bool]) -> float:
    return 100 * sum(hits) / len(hits)


def is_outlier(error: float, truth: float) -> bool:
    return abs(error) > 3 + TIE and abs(error) > 0.05 * abs(truth) + TIE


def quarter(pixels: Pixels) -> float:
    answered = sorted(abs(e) for e, _ in pixels if not isnan(e))
    place = 0.25 * (len(answered) - 1)
    low = int(place)
    high = min(low + 1, len(answered) - 1)
    return 100 * (answered[low] + (place - low) * (answered[high] - answered[low]))


def square(pixels: Pixels) -> float:
    answered = [e for e, _ in pixels if not isnan(e)]
    return 100 * sum(e * e for e in answered) / len(answered)


TWINS: dict[str, Callable[[Pixels], float]] = {
    "d1": lambda pixels: share([is_outlier(e, t) for e, t in pixels]),
    "total_d1": lambda pixels: share([isnan(e) or is_outlier(e, t) for e, t in pixels]),
    "mse_100": square,
    "q25": quarter,
    "fattening": lambda pixels: share([e > 0.15 + TIE for e, _ in pixels]),
    "thinning": lambda pixels: share([e < -0.15 - TIE for e, _ in pixels]),
}


@pytest.mark.parametrize("seed", range(8))
def test_each_metric_is_its_twin(seed: int) -> None:
    scene, estimate, mask = made(seed)
    truth = scene.truth[1]
    pixels = [
        ((float(estimate[place]) - float(truth[place])) * STEPS, float(truth[place]) * STEPS)
        for place in np.ndindex(truth.shape)
        if mask[place] and not isnan(truth[place])
    ]
    for metric in OWN:
        if metric.name != "bumpiness":
            assert found(metric, scene, estimate, mask) == pytest.approx(TWINS[metric.name](pixels)), metric.name
    assert {metric.name for metric in OWN} == {*TWINS, "bumpiness"}


WEIGHTS = (3 / 16, 10 / 16, 3 / 16)


def slope(values: Callable[[int, int], float], row: int, column: int, axis: int) -> float:
    """Scharr's filter at a pixel."""
    total = 0.0
    for aside, weight in zip((-1, 0, 1), WEIGHTS, strict=True):
        ahead, behind = ((1, aside), (-1, aside)) if axis == 0 else ((aside, 1), (aside, -1))
        total += weight * values(row + ahead[0], column + ahead[1])
        total -= weight * values(row + behind[0], column + behind[1])
    return total


def bump(error: NDArray[np.float64], row: int, column: int) -> float:
    """The bumpiness of a pixel; NaN where a pixel of the 5x5 around it is outside or has no error."""
    window = [(row + y, column + x) for y in range(-2, 3) for x in range(-2, 3)]
    if any(not (0 <= y < error.shape[0] and 0 <= x < error.shape[1]) or isnan(error[y, x]) for y, x in window):
        return nan
    squares = 0.0
    for first in (0, 1):
        for second in (0, 1):
            inner = lambda y, x, first=first: slope(lambda v, u: float(error[v, u]), y, x, first)  # noqa: E731
            squares += slope(inner, row, column, second) ** 2
    return min(0.05, sqrt(squares))


@pytest.mark.parametrize("seed", range(3))
def test_bumpiness_is_its_twin(seed: int) -> None:
    mask = made(seed)[2]
    random = np.random.default_rng(seed)
    whole = scene_of(np.zeros((9, 11), np.float32))
    estimate = random.uniform(0, 0.01, (9, 11)).astype(np.float32)
    estimate[0, 0] = np.nan
    where = map_in_region(whole, estimate, mask)
    twin = np.array([[bump(where.error, y, x) for x in range(11)] for y in range(9)])
    np.testing.assert_allclose(bumps(where), twin, rtol=1e-9)
    assert 0 < np.nanmin(twin) < 0.05, "not everything is clipped"
    metric = next(metric for metric in OWN if metric.name == "bumpiness")
    assert found(metric, whole, estimate, mask) == pytest.approx(100 * np.nanmean(twin[mask]))
    assert isnan(found(metric, whole, np.full((9, 11), np.nan, np.float32), mask)), "nothing is answered"


def test_what_runs_evenly_beside_the_truth_has_no_bumps() -> None:
    scene = scene_of(np.zeros((9, 11), np.float32))
    ramp = np.add.outer(0.25 * np.arange(9), 0.5 * np.arange(11)).astype(np.float32)
    metric = next(metric for metric in OWN if metric.name == "bumpiness")
    assert found(metric, scene, ramp, np.ones((9, 11), bool)) == pytest.approx(0, abs=1e-9)
    parabola = np.tile((0.001 * np.arange(11) ** 2).astype(np.float32), (9, 1))
    # the second derivative is 0.002 px of a step, 0.004 of the pair; each of the two filters doubles it
    assert found(metric, scene, parabola, np.ones((9, 11), bool)) == pytest.approx(100 * 4 * 0.004, rel=1e-3)


def test_kitti_takes_the_larger_of_both_bounds() -> None:
    """3 px decide for near zero truth, 5 % for large truth; ties are not bad. In px of the pair, two steps wide."""
    truth = np.array([[10, 10, 50, 50, 50, -50, 10]], np.float32)
    error = np.array([[3.0, 3.5, 3.5, 5.0, 5.5, -5.5, nan]], np.float32)
    scene, everywhere = scene_of(truth), np.ones(truth.shape, bool)
    estimate = truth + error / 2
    d1, total = (next(metric for metric in OWN if metric.name == name) for name in ("d1", "total_d1"))
    assert found(d1, scene, estimate, everywhere) == pytest.approx(100 * 3 / 7)
    assert found(total, scene, estimate, everywhere) == pytest.approx(100 * 4 / 7)
    assert total.picture is not None
    np.testing.assert_array_equal(
        total.picture(map_in_region(scene, estimate, everywhere)), [[0, 100, 0, 0, 100, 100, 100]]
    )


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 10**5), st.integers(0, 100))
def test_any_threshold_is_counted_pixel_by_pixel(thousandths: int, seed: int) -> None:
    threshold = thousandths / 1000
    scene, estimate, mask = made(seed)
    truth = scene.truth[1]
    known = mask & np.isfinite(truth)
    error = [abs(float(a) - float(b)) * STEPS for a, b in zip(estimate[known], truth[known], strict=True)]
    bad, total = (family.named(f"{family.name[:-1]}{threshold:g}") for family in (BAD, TOTAL_BAD))
    assert found(bad, scene, estimate, mask) == pytest.approx(share([e > threshold + TIE for e in error]))
    assert found(total, scene, estimate, mask) == pytest.approx(share([isnan(e) or e > threshold + TIE for e in error]))


def test_any_quantile() -> None:
    scene, everywhere = scene_of(np.zeros((1, 11), np.float32)), np.ones((1, 11), bool)
    estimate = np.arange(11, dtype=np.float32)[None] / 2  # errors 0 to 10 px of the pair
    assert found(QUANTILES.named("a75"), scene, estimate, everywhere) == pytest.approx(7.5)
    assert found(QUANTILES.named("a100"), scene, estimate, everywhere) == 10


def test_sets_name_metrics_that_exist_and_lead_with_one_that_counts_silence() -> None:
    for one in SETS.values():
        known = [metric_catalogue.metric_named(name) for name in one.metrics]
        assert [metric.name for metric in known] == list(one.metrics)
        assert not known[0].answered_only
    with pytest.raises(UserError, match="unknown metrics 'kiti': did you mean 'kitti'"):
        set_named("kiti")


def test_metrics_of_benchmarks_do_not_write_to_what_they_are_given() -> None:
    scene, estimate, mask = made(1)
    where: MapInRegion = map_in_region(scene, estimate, mask)
    before = where.error.copy()
    score(estimate, scene.truth[1], mask, STEPS, OWN, scene)
    np.testing.assert_array_equal(where.error, before)
