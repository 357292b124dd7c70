"""Scores of confidence maps: against a slow twin, the published best area, ties, and orders that know or invert."""

from itertools import pairwise, permutations
from math import log, pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from matbench.measures.confidence import (
    METRICS,
    STEPS,
    ConfidenceMetric,
    RankedErrors,
    area,
    area_above_best,
    best_risks,
    sparsification,
    sparsification_error,
)
from matbench.results.metric_catalogue import metric_named


def ranked(errors: list[float], confidence: list[float]) -> RankedErrors:
    return RankedErrors.of(np.array(errors, np.float64), np.array(confidence, np.float32))


def slow_risks(losses: list[float], confidence: list[float]) -> list[float]:
    """The mean, over all orders from the surest on, of the mean loss of the first pixels."""
    every = [
        order
        for order in permutations(range(len(losses)))
        if all(confidence[a] >= confidence[b] for a, b in pairwise(order))
    ]
    return [
        float(np.mean([np.mean([losses[i] for i in order[:count]]) for order in every]))
        for count in range(1, len(losses) + 1)
    ]


PIXELS = st.lists(st.tuples(st.floats(0, 9), st.sampled_from([0.0, 0.25, 0.5, 1.0])), min_size=1, max_size=6)


@given(PIXELS)
def test_risks_are_the_mean_over_all_orders(pixels: list[tuple[float, float]]) -> None:
    losses, confidence = (list(column) for column in zip(*pixels, strict=True))
    found = ranked(losses, confidence).risks(np.array(losses))
    np.testing.assert_allclose(found, slow_risks(losses, confidence), rtol=1e-12, atol=1e-12)


@given(PIXELS)
def test_no_confidence_is_better_than_the_best(pixels: list[tuple[float, float]]) -> None:
    losses, confidence = (list(column) for column in zip(*pixels, strict=True))
    some = ranked(losses, confidence)
    assert (some.risks(np.array(losses)) >= best_risks(np.array(losses)) - 1e-9).all()
    assert area_above_best(some, 1) >= -1e-9
    assert sparsification_error(some) >= -1e-9


def test_the_best_area_is_as_published() -> None:
    """Hu & Mordohai 2012, equation 22: e + (1 - e) ln(1 - e)."""
    errors = np.where(np.arange(20000) < 4000, 3.0, 0.0)
    found = area(RankedErrors.of(errors, (errors == 0).astype(np.float32)), 1)
    assert found == pytest.approx(100 * (0.2 + 0.8 * log(0.8)), abs=0.01)


def test_orders_that_know_invert_or_do_not_care() -> None:
    errors = np.random.default_rng(0).exponential(1, 5000)
    knows = RankedErrors.of(errors, np.exp(-errors).astype(np.float32))
    inverts = RankedErrors.of(errors, (1 - np.exp(-errors)).astype(np.float32))
    same = RankedErrors.of(errors, np.full(errors.shape, 0.3, np.float32))
    share = 100 * float((errors > 1 + 1e-4).mean())
    assert area_above_best(knows, 1) == pytest.approx(0, abs=1e-9)
    assert sparsification_error(knows) == pytest.approx(0, abs=1e-6)
    assert area(same, 1) == pytest.approx(share)
    assert area(knows, 1) < area(same, 1) < area(inverts, 1)
    # the best curve's area is the integral of ln(u) ln(1 - u) over [0, 1], 2 - pi^2 / 6
    assert sparsification_error(same) == pytest.approx(pi**2 / 6 - 1, abs=0.02)


def test_what_is_not_answered_has_no_place_and_unknown_confidence_comes_last() -> None:
    found = ranked([0.0, np.nan, 5.0], [np.nan, 1.0, 0.5])
    assert found.error.tolist() == [0.0, 5.0]
    assert found.risks(found.error).tolist() == [5.0, 2.5]


def test_arguments_cannot_be_written() -> None:
    found = ranked([1.0, 2.0], [0.5, 0.5])
    with pytest.raises(ValueError, match="read-only"):
        found.error[0] = 3
    with pytest.raises(ValueError, match="read-only"):
        found.confidence[0] = 3


def test_without_errors_every_order_is_perfect() -> None:
    assert sparsification_error(ranked([0.0, 0.0], [0.1, 0.2])) == 0
    assert area(ranked([0.0, 0.0], [0.1, 0.2]), 1) == 0


def test_an_error_at_the_threshold_is_not_bad() -> None:
    assert ranked([1.0, 1.00005, 1.001], [0, 0, 0]).bad(1).tolist() == [0, 0, 100]


def test_any_threshold_by_name() -> None:
    some = ranked([0.0, 2.5, 3.5], [1, 0.5, 0.2])
    for name, wanted in (("aurc_3", area(some, 3)), ("ause_0.5", area_above_best(some, 0.5)), ("ause_1", 0)):
        metric = metric_named(name)
        assert isinstance(metric, ConfidenceMetric)
        assert metric.compute(some) == pytest.approx(wanted)
    assert [one.name for one in METRICS] == ["aurc_1", "ause_1", "ause", "aurc_@", "ause_@"]


@pytest.mark.parametrize("count", [1, 7, STEPS, 1000])
def test_curves_end_with_all_pixels(count: int) -> None:
    errors = np.linspace(0, 3, count)
    curve = sparsification(RankedErrors.of(errors, (3 - errors).astype(np.float32) / 3))
    coverage, risk, best, pixels = (list(column) for column in zip(*curve, strict=True))
    assert coverage == pytest.approx([100 * step / STEPS for step in range(1, STEPS + 1)])
    assert pixels == [int(np.ceil(step * count / STEPS)) for step in range(1, STEPS + 1)]
    assert risk[-1] == pytest.approx(100 * float((errors > 1.0001).mean()))
    assert risk == pytest.approx(best)


def test_no_answer_gives_no_curve() -> None:
    assert sparsification(ranked([np.nan], [0.5])) == []
