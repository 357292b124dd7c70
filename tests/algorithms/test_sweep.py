"""Costs of a plane sweep against a plain twin, pixel by pixel in float64."""

import numpy as np
import pytest
from attrs import evolve
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from rigs import uneven

from matbench import load_scene
from matbench.algorithms.fusion import Fusion
from matbench.algorithms.sampling import fine_rows
from matbench.algorithms.similarity import Matcher, Matching
from matbench.algorithms.sweep import Costs, Sweep, best_window, box, filled
from matbench.parameters import silent_in
from matbench.scene import Range, Scene


def scene_of(shape: tuple[int, int, int], seed: int, least: float, largest: float, ref: int, pair: float = 1) -> Scene:
    views = np.random.default_rng(seed).integers(0, 256, (*shape, 3), np.uint8)
    return Scene("test", views, tuple(map(str, range(shape[0]))), ref, Range(least, largest), {}, pair)


def slow_difference(sweep: Sweep, view: int, plane: int) -> NDArray[np.float64]:
    """What `Sweep.difference` is, sample by sample."""
    space, settings = sweep.space, sweep.settings
    fine = fine_rows(sweep.scene.views, space.fineness).astype(float)
    power = 2 if settings.difference == "squared" else 1
    out = np.full((space.rows, space.width), np.nan)
    for y, x in np.ndindex(out.shape):
        here = space.fineness * x
        there = here - (view - sweep.scene.ref) * (space.first + plane)
        if 0 <= there < space.samples:
            gap = np.mean(np.abs(fine[sweep.scene.ref, :, y, here] - fine[view, :, y, there]) ** power)
            out[y, x] = min(gap, settings.truncation**power) if settings.truncation else gap
    return out


def slow_box(values: NDArray[np.float64], radius: int) -> NDArray[np.float64]:
    out = np.full(values.shape, np.nan)
    for y, x in zip(*np.nonzero(np.isfinite(values)), strict=True):
        out[y, x] = np.nanmean(values[max(0, y - radius) : y + radius + 1, max(0, x - radius) : x + radius + 1])
    return out


def slow_best_window(means: NDArray[np.float64], radius: int) -> NDArray[np.float64]:
    out = np.full(means.shape, np.nan)
    for y, x in zip(*np.nonzero(np.isfinite(means)), strict=True):
        out[y, x] = np.nanmin(means[max(0, y - radius) : y + radius + 1, max(0, x - radius) : x + radius + 1])
    return out


def slow_selection(costs: list[float], ref: int, selection: str) -> float:
    known = sorted(cost for cost in costs if np.isfinite(cost))
    if not known:
        return float("nan")
    if selection == "side":
        sides = ([cost for cost in side if np.isfinite(cost)] for side in (costs[:ref], costs[ref:]))
        return min(float(np.mean(side)) for side in sides if side)
    return float(np.mean(known[: (len(known) + 1) // 2] if selection == "half" else known))


def slow_cost(sweep: Sweep) -> NDArray[np.float64]:
    space, settings = sweep.space, sweep.settings
    radius = settings.window // 2
    out = np.full((space.rows, space.width, space.planes), np.nan)
    for plane in range(space.planes):
        each = [slow_box(slow_difference(sweep, view, plane), radius) for view in sweep.others]
        if settings.shiftable:
            each = [slow_best_window(means, radius) for means in each]
        for y, x in np.ndindex(space.rows, space.width):
            out[y, x, plane] = slow_selection([means[y, x] for means in each], sweep.scene.ref, settings.selection)
    return out


@settings(max_examples=30, deadline=None)
@given(
    views=st.integers(2, 5),
    rows=st.integers(1, 4),
    width=st.integers(1, 7),
    least=st.integers(-2, 1),
    planes=st.integers(0, 3),
    settings=st.builds(
        Costs,
        fineness=st.integers(1, 3),
        difference=st.sampled_from(["absolute", "squared"]),
        truncation=st.sampled_from([0.0, 60.0]),
        window=st.sampled_from([1, 3, 5]),
        shiftable=st.booleans(),
        selection=st.sampled_from(["mean", "half", "side"]),
    ),
    seed=st.integers(0, 999),
)
def test_agrees_with_its_slow_twin(
    views: int, rows: int, width: int, least: int, planes: int, settings: Costs, seed: int
) -> None:
    scene = scene_of((views, rows, width), seed, least, least + planes, seed % views)
    sweep = Sweep.of(scene, settings)
    expected = slow_cost(sweep)
    np.testing.assert_allclose(sweep.cost(), expected, rtol=1e-4, atol=1e-2)
    counted = sum(
        int(np.isfinite(slow_difference(sweep, view, plane)).sum())
        for view in sweep.others
        for plane in range(sweep.space.planes)
    )
    assert sweep.compared == {"pixel_differences": counted}


def test_another_reference_view_is_another_sweep() -> None:
    scene = scene_of((4, 5, 12), 1, 0, 3, 0)
    moved = Sweep.of(scene, Costs(window=3)).with_reference(2)
    np.testing.assert_array_equal(moved.cost(), Sweep.of(evolve(scene, ref=2), Costs(window=3)).cost())


def test_shared_costs_are_those_of_the_control() -> None:
    scene = scene_of((5, 9, 14), 2, 0, 3, 2, pair=2)
    expected = Fusion().first_cost(Matcher.of(scene, Matching())).transpose(0, 2, 1)
    sweep = Sweep.of(scene, Costs(similarity="shared"))
    np.testing.assert_array_equal(sweep.cost(), expected)
    np.testing.assert_array_equal(
        sweep.with_reference(0).cost().transpose(0, 2, 1),
        Fusion().first_cost(Matcher.of(scene, Matching()).with_reference(0)),
    )
    windowed = Sweep.of(scene, Costs(similarity="shared", window=3, shiftable=True)).cost()
    np.testing.assert_array_equal(windowed[:, :, 1], best_window(box(expected[:, :, 1].copy(), 3), 3))
    assert sweep.compared == {"pair_similarities": Matcher.of(scene, Matching()).ray_comparisons}


def test_threads_change_nothing() -> None:
    scene = scene_of((4, 30, 40), 3, -1, 4, 1, pair=2)
    for kind in (Costs(window=5, shiftable=True), Costs(similarity="shared")):
        once, twice = (Sweep.of(scene, kind).cost(threads) for threads in (1, 2))
        np.testing.assert_array_equal(once, twice)


def test_fewer_views_answer_in_the_steps_of_the_scene() -> None:
    sweep = Sweep.of(scene_of((5, 3, 20), 4, 0, 3, 2), Costs(views=3))
    assert sweep.indices == (0, 2, 4)
    np.testing.assert_array_equal(sweep.disparity(np.array([0.0, 3.0])), [0, 1.5])


def test_what_is_unknown_says_nothing() -> None:
    nan = float("nan")
    cost = np.array([[[1, nan, 5], [nan, nan, nan], [1, 2, 3]]], np.float32)
    np.testing.assert_array_equal(filled(cost), [[[1, 3, 5], [0, 0, 0], [1, 2, 3]]])


@pytest.mark.parametrize(
    ("settings", "silent"),
    [
        (Costs(window=3), set()),
        (Costs(), {"shiftable"}),
        (Costs(views=2, window=3), {"selection"}),
        (Costs(similarity="shared", window=3), {"difference", "truncation", "selection"}),
    ],
)
def test_what_is_not_read_is_said(settings: Costs, silent: set[str]) -> None:
    assert set(silent_in(settings)) == silent


@pytest.mark.parametrize("wrong", [{"window": 2}, {"truncation": -1}, {"selection": "best"}, {"difference": "cubed"}])
def test_wrong_parameters(wrong: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=next(iter(wrong))):
        Costs(**wrong)  # type: ignore[arg-type]


def test_views_at_uneven_steps_cost_what_they_cost_among_all_views() -> None:
    """On the finer grid the planes are those of all views, of which some are missing."""
    full = load_scene("synthetic/box[n=6 ref=2 size=48x36]")
    scene = uneven(full, (0, 2, 5), 2)
    some, all_views = Sweep.of(scene, Costs()), Sweep.of(full, Costs())
    assert (some.places, some.step, some.space.first) == ((0, 2, 5), 0.5, all_views.space.first)
    for plane in range(some.space.planes):
        for view, kept in enumerate((0, 2, 5)):
            np.testing.assert_array_equal(some.difference(view, plane), all_views.difference(kept, plane))
            assert some.whole_homologues(view, plane) == all_views.whole_homologues(kept, plane)
    planes = np.array([[0.0, 3.5]], np.float32)
    np.testing.assert_allclose(some.disparity(planes), 2 * all_views.disparity(planes), rtol=1e-6)
