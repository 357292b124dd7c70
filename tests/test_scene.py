"""Scene, range and choice of views."""

from itertools import combinations, product

import numpy as np
import pytest
from attrs import evolve

from matbench.scene import Range, Scene, SceneError, evenly_spaced


def make(n: int = 9, ref: int = 2, pair_steps: float = 4) -> Scene:
    rng = np.random.default_rng(0)
    return Scene(
        "a",
        rng.integers(0, 256, (n, 4, 5, 3), np.uint8),
        tuple(str(i) for i in range(n)),
        ref,
        Range(-1, 3),
        {ref: np.array([[1.5, np.nan, 2, 3, 0]] * 4, np.float32)},
        pair_steps,
        {"all": np.ones((4, 5), bool)},
    )


def test_choosing_views_rescales_disparities_truth_and_pair() -> None:
    scene = make()
    chosen = scene.choose([0, 2, 4, 6, 8])
    assert (chosen.n, chosen.ref, chosen.pair_steps, chosen.labels) == (5, 1, 2, ("0", "2", "4", "6", "8"))
    assert chosen.disparities == Range(-2, 6)
    np.testing.assert_array_equal(chosen.truth[1], scene.truth[2] * 2)
    np.testing.assert_array_equal(chosen.views, scene.views[::2])
    assert chosen.regions["all"] is scene.regions["all"]


@pytest.mark.parametrize(
    ("bounds", "row"),
    [
        ((-1, 3), [0, 0, 0, 0, 0]),
        ((0, 2.99999), [0, 0, 0, 0, 0]),  # rounding
        ((0, 2.9), [0, 0, 0, 1, 0]),
        ((1.6, 3), [1, 0, 0, 0, 1]),
        ((5, 6), [1, 0, 1, 1, 1]),
    ],
)
def test_truth_outside_the_range_is_marked(bounds: tuple[float, float], row: list[int]) -> None:
    scene = evolve(make(), disparities=Range(*bounds))
    np.testing.assert_array_equal(scene.out_of_range, np.array([row] * 4, bool))
    np.testing.assert_array_equal(scene.choose([0, 2, 4]).out_of_range, scene.out_of_range)
    assert not evolve(scene, truth={}).out_of_range.any()


@pytest.mark.parametrize("indices", [[2], [], [0, 1, 3], [4, 2, 0], [2, 2], [0, 1], [2, 11], [-1, 2]])
def test_impossible_choices_are_refused(indices: list[int]) -> None:
    with pytest.raises(SceneError) as error:
        make().choose(indices)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("n", "ref", "count", "views"),
    [
        (5, 2, 4, (1, 2, 3, 4)),  # Tsukuba col2-5
        (7, 1, 4, (0, 1, 2, 3)),  # Rocks1 view0-3
        (9, 2, 4, (0, 2, 4, 6)),  # Teddy im0, 2, 4, 6
        (9, 2, 9, tuple(range(9))),
        (9, 2, 20, tuple(range(9))),
        (2, 1, 4, (0, 1)),
        (9, 2, 2, (2, 8)),
    ],
)
def test_the_widest_choice_is_that_of_the_paper(n: int, ref: int, count: int, views: tuple[int, ...]) -> None:
    assert make(n, ref).widest(count) == views


@pytest.mark.parametrize("n", range(2, 10))
def test_evenly_spaced_views_are_the_widest_of_all_that_there_are(n: int) -> None:
    for ref, count in product(range(n), range(2, n + 1)):
        every = [c for c in combinations(range(n), count) if ref in c and len(set(np.diff(c))) == 1]
        found = evenly_spaced(n, ref, count)
        assert found in every
        assert found[-1] - found[0] == max(c[-1] - c[0] for c in every)
        for baseline in range(n + 2):
            some = [c for c in every if c[-1] - c[0] == baseline]
            exact = evenly_spaced(n, ref, count, baseline)
            assert exact in some if some else exact == ()
            nearest = min((abs(2 * ref - c[0] - c[-1]) for c in some), default=0)
            assert not some or abs(2 * ref - exact[0] - exact[-1]) == nearest, "the reference view is near its middle"


def test_arrays_are_read_only_and_detached_from_the_caller() -> None:
    views = np.zeros((2, 3, 3, 3), np.uint8)
    scene = Scene("a", views, ("0", "1"), 0, Range(0, 1), {}, 1)
    views[:] = 7
    assert scene.views.max() == 0
    with pytest.raises(ValueError, match="read-only"):
        scene.views[0] = 1


def test_digests_follow_pixels_and_truth_apart() -> None:
    scene = make()
    other_truth = evolve(scene, truth={2: np.zeros((4, 5), np.float32)})
    other_pixels = evolve(scene, views=255 - scene.views)
    assert (scene.digest, scene.truth_digest) == (make().digest, make().truth_digest)
    assert other_truth.digest == scene.digest
    assert other_truth.truth_digest != scene.truth_digest
    assert other_pixels.digest != scene.digest


@pytest.mark.parametrize(
    "change",
    [
        {"views": np.zeros((1, 4, 5, 3), np.uint8)},
        {"views": np.zeros((9, 4, 5), np.uint8)},
        {"views": np.zeros((9, 4, 5, 3), np.float32)},
        {"views": np.zeros((9, 0, 5, 3), np.uint8)},
        {"labels": ("a",)},
        {"ref": 9},
        {"pair_steps": 0.0},
        {"pair_steps": float("nan")},
        {"truth": {2: np.zeros((4, 4), np.float32)}},
        {"truth": {11: np.zeros((4, 5), np.float32)}},
        {"regions": {"all": np.zeros((4, 5), np.uint8)}},
        {"visible": {0: np.zeros((4, 5), bool)}},
    ],
)
def test_contradictions_are_refused(change: dict[str, object]) -> None:
    with pytest.raises(SceneError):
        evolve(make(), **change)


@pytest.mark.parametrize("bounds", [(1, 0), (0, float("inf")), (float("nan"), 1)])
def test_empty_or_unbounded_ranges_are_refused(bounds: tuple[float, float]) -> None:
    with pytest.raises(SceneError):
        Range(*bounds)


def test_uneven_steps_are_kept_until_the_chosen_views_are_even() -> None:
    scene = evolve(make(4), positions=(0, 1, 2, 3.5))
    assert not scene.is_even
    assert [scene.steps(view) for view in range(4)] == [-2, -1, 0, 1.5]
    assert (scene.at(1.5), scene.at(-1), scene.at(2)) == (3, 1, None)
    assert evolve(make(3), positions=(0, 1, 2)).is_even
    assert scene.digest not in {make(4).digest, evolve(scene, positions=(0, 1, 2, 3.4)).digest}

    three = scene.choose([0, 2, 3])
    assert (three.positions, three.disparities, three.pair_steps) == ((0, 2, 3.5), Range(-1, 3), 4)
    two = scene.choose([2, 3])
    assert two.is_even
    assert (two.disparities, two.pair_steps) == (Range(-1.5, 4.5), 4 / 1.5)
    np.testing.assert_array_equal(two.truth[0], scene.truth[2] * np.float32(1.5))
    assert scene.choose([0, 1, 2]).is_even


@pytest.mark.parametrize("positions", [(0, 1, 1, 2), (1, 2, 3, 5), (0, 1, 3), (0, 2, 1, 3), (0, 1, 2, float("nan"))])
def test_positions_that_do_not_increase_from_0_are_refused(positions: tuple[float, ...]) -> None:
    with pytest.raises(SceneError, match="4 numbers that begin with 0 and increase are needed"):
        evolve(make(4), positions=positions)
