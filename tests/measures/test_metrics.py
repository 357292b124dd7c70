"""Scores: published numbers, perfect and empty maps, ties, holes."""

from itertools import product
from math import isnan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from real import Real

from matbench import load_scene
from matbench.files.images import read_levels
from matbench.measures.metrics import METRICS, MapInRegion, Metric, error_map, quantile, score

NAMES = [
    "bad_0.5",
    "bad_1",
    "bad_2",
    "bad_4",
    "total_bad_0.5",
    "total_bad_1",
    "total_bad_2",
    "total_bad_4",
    "invalid",
    "avg",
    "bias",
    "rms",
    "a50",
    "a90",
    "a95",
    "a99",
]


def _map(*values: float) -> np.ndarray:
    return np.array([values], np.float32)


def _all(array: np.ndarray) -> np.ndarray:
    return np.ones(array.shape, bool)


@pytest.mark.parametrize(
    ("scene", "grey", "published"),
    [
        ("tsukuba", 16, (2.09, 2.33, 9.31)),
        ("venus", 8, (0.21, 0.39, 2.62)),
        ("teddy", 4, (2.99, 8.16, 9.62)),
    ],
)
def test_patchmatch_scores_as_published(real: Real, scene: str, grey: int, published: tuple[float, ...]) -> None:
    """Bleyer et al. 2011, bad pixels at 1 px in per cent: nonocc, all, disc."""
    folder = real(f"middlebury/eval_v2/{scene}") / "middlebury/eval_v2" / scene
    estimate, truth = (
        read_levels(folder / f"{name}.png").astype(np.float32) / grey for name in ("alg117", "groundtruth")
    )
    masks = [read_levels(folder / f"{name}.png") == 255 for name in ("nonocc", "all", "disc")]
    found = [score(estimate, truth, mask, 1)["bad_1"] for mask in masks]
    assert [f"{value:.2f}" for value in found] == [f"{value:.2f}" for value in published]


def test_metrics_in_order() -> None:
    assert [metric.name for metric in METRICS] == NAMES
    assert {metric.unit for metric in METRICS[:9]} == {"%"}
    assert {metric.unit for metric in METRICS[9:]} == {"px"}
    assert list(score(_map(1), _map(1), _all(_map(1)), 1)) == NAMES


def test_perfect_map_scores_zero_where_truth_has_holes() -> None:
    truth = _map(1, np.nan, 3, 4)
    assert set(score(truth, truth, _all(truth), 4).values()) == {0.0}
    answered = np.where(np.isnan(truth), 99, truth).astype(np.float32)
    assert set(score(answered, truth, _all(truth), 4).values()) == {0.0}


@pytest.mark.parametrize("nothing", [np.nan, np.inf, -np.inf])
def test_empty_map_is_all_bad(nothing: float) -> None:
    truth = _map(1, 2, np.nan)
    found = score(np.full_like(truth, nothing), truth, _all(truth), 1)
    assert all(found[f"total_bad_{t}"] == 100 for t in ("0.5", "1", "2", "4"))
    assert found["invalid"] == 100
    assert all(found[f"bad_{t}"] == 0 for t in ("0.5", "1", "2", "4"))
    assert all(isnan(found[name]) for name in NAMES[9:])


def test_ties_are_not_bad_but_more_is() -> None:
    truth = _map(5, 5, 5, 5)
    # errors of 1, 1 + 8e-5 (within rounding), 1 + 4e-4 and 1.2 px of the pair
    found = score(_map(5.25, 5.25002, 5.2501, 4.7), truth, _all(truth), 4)
    assert found["bad_1"] == 50


def test_errors_are_in_pixels_of_the_pair() -> None:
    truth = _map(0, 0)
    assert score(_map(1, 1), truth, _all(truth), 4)["avg"] == 4
    assert error_map(_map(-1.5, np.nan), truth, 2)[0, 0] == 3
    assert isnan(error_map(_map(-1.5, np.nan), truth, 2)[0, 1])


def test_numbers_worked_out_by_hand() -> None:
    truth = _map(0, 0, 0, 0, 0, 7)
    mask = np.array([[True] * 5 + [False]])
    found = score(_map(0, 1, -3, 5, np.nan, 0), truth, mask, 1)
    wanted = {
        "bad_1": 40,
        "total_bad_1": 60,
        "bad_4": 20,
        "invalid": 20,
        "avg": 9 / 4,
        "bias": 3 / 4,
        "rms": (35 / 4) ** 0.5,
        "a50": 2,
    }
    assert {name: found[name] for name in wanted} == pytest.approx(wanted)


def test_empty_region_has_no_scores() -> None:
    truth = _map(1, np.nan)
    for mask in (np.zeros((1, 2), bool), np.array([[False, True]])):
        assert all(isnan(value) for value in score(truth, truth, mask, 1).values())


def test_shapes_must_agree() -> None:
    with pytest.raises(ValueError, match="must agree"):
        score(_map(1), _map(1, 2), _all(_map(1, 2)), 1)


def test_a_metric_of_ones_own() -> None:
    worst = Metric("worst", "px", "lower", "largest error", lambda errors: float(np.nanmax(errors)))
    truth = _map(0, 0)
    assert score(_map(1, -3), truth, _all(truth), 2, [worst]) == {"worst": 6}


def test_each_kind_of_metric_is_given_what_it_takes() -> None:
    scene = load_scene("synthetic/box[size=48x36]")
    truth, steps = scene.truth[scene.ref], scene.pair_steps
    estimate = (truth + np.float32(1)).astype(np.float32)
    estimate[:, 10] = truth[:, 10] - 2
    estimate[0] = np.nan
    estimate[1, 0] = np.inf
    mask = np.zeros(truth.shape, bool)
    mask[:5, 8:20] = True
    seen: dict[str, object] = {}

    def look(kind: str) -> Metric:
        def compute(given: object) -> float:
            seen[kind] = given
            return 1.0

        return Metric(kind, "px", "lower", "", compute, takes=kind)  # type: ignore[arg-type]

    kinds = ("absolute", "signed", "map")
    assert score(estimate, truth, mask, steps, map(look, kinds), scene) == dict.fromkeys(kinds, 1.0)
    absolute, signed, whole = (seen[kind] for kind in kinds)
    assert isinstance(whole, MapInRegion)
    assert isinstance(signed, np.ndarray)
    assert sorted({round(float(v), 4) for v in signed[~np.isnan(signed)]}) == [-2 * steps, steps]
    np.testing.assert_array_equal(absolute, np.abs(signed))
    np.testing.assert_array_equal(whole.error[mask], signed)
    np.testing.assert_array_equal(whole.truth, truth)
    assert np.isnan(whole.estimate[1, 0]), "infinite is no answer, neither here"
    assert whole.error[30, 40] == pytest.approx(steps), "the rest of the map is there, too"
    assert whole.scene is scene
    for array in (absolute, signed, whole.estimate, whole.mask, whole.error, whole.truth):
        with pytest.raises(ValueError, match="read-only"):
            array[:] = 0  # type: ignore[index]


def test_a_metric_of_the_map_needs_a_scene() -> None:
    spatial = Metric("m", "", "lower", "", lambda _: 0.0, takes="map")
    with pytest.raises(ValueError, match="metric m takes a map: give its scene"):
        score(_map(1), _map(1), _all(_map(1)), 1, [spatial])


def test_a_metric_that_fails_harms_no_other() -> None:
    wrong = Metric("wrong", "", "lower", "", lambda found: found.nothing, takes="signed")
    with pytest.warns(UserWarning, match="metric wrong failed: AttributeError"):
        found = score(_map(2), _map(1), _all(_map(1)), 1, [wrong, *METRICS])
    assert isnan(found["wrong"])
    assert found["bias"] == found["avg"] == 1


@given(
    st.lists(st.floats(0, 9, width=32) | st.just(float("nan")), min_size=1, max_size=20),
    st.sampled_from(["0.5", "1", "2", "4"]),
)
def test_bad_and_invalid_make_total_bad(errors: list[float], threshold: str) -> None:
    estimate = _map(*errors)
    found = score(estimate, np.zeros_like(estimate), _all(estimate), 1)
    assert found[f"total_bad_{threshold}"] == pytest.approx(found[f"bad_{threshold}"] + found["invalid"])


@pytest.mark.parametrize("count", [1, 2, 3, 10, 101, 4000])
def test_quantiles_are_numpys_to_the_last_bit(count: int) -> None:
    rows = np.random.default_rng(count).exponential(1, (20, count))
    for row, share in product(rows, (0.5, 0.9, 0.95, 0.99)):
        assert quantile(row, share) == np.quantile(row, share)
