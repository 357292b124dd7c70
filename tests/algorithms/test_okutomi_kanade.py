"""Okutomi & Kanade's SSSD against a plain NumPy twin and on scenes whose answer is known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from matbench.algorithm import Context
from matbench.algorithms.okutomi_kanade import OkutomiKanade
from matbench.algorithms.sampling import fine_rows, search_space
from matbench.scene import Range, Scene


def scene_of(
    views: NDArray[np.uint8], least: float, largest: float, ref: int = 0, pair_steps: float = 1, name: str = "test"
) -> Scene:
    return Scene(name, views, tuple(map(str, range(len(views)))), ref, Range(least, largest), {}, pair_steps)


def noise(shape: tuple[int, ...], seed: int) -> NDArray[np.uint8]:
    return np.random.default_rng(seed).integers(0, 256, shape, dtype=np.uint8)


def plane_scene(disparity: int, seed: int = 1, n: int = 4, ref: int = 1, width: int = 48) -> NDArray[np.uint8]:
    """A noisy wall: view j is cut from one wide texture, j * disparity further right."""
    reach = n * abs(disparity)
    texture = noise((20, width + 2 * reach, 3), seed)
    starts = [reach + (j - ref) * disparity for j in range(n)]
    return np.stack([texture[:, s : s + width] for s in starts])


def smooth_scene(disparity: float, n: int = 5, ref: int = 2, width: int = 60) -> NDArray[np.uint8]:
    """A wall of slow waves that can be sampled anywhere: x_j = x_ref - (j - ref) * disparity."""
    x, y = np.arange(width), np.arange(16)[:, None]
    views = []
    for j in range(n):
        u = x + (j - ref) * disparity
        waves = [np.sin(u / 3 + y / 5), np.cos(u / 4.1 - y / 3), np.sin(u / 2.6 + y / 2 + 1)]
        views.append(np.stack([np.round(127 + 100 * wave) for wave in waves], axis=2).astype(np.uint8))
    return np.stack(views)


def slow(scene: Scene, method: OkutomiKanade) -> tuple[NDArray[np.float64], int]:
    """Disparities and number of windows, window by window in float64."""
    space = search_space(scene, method.fineness)
    q, radius = space.fineness, method.window // 2
    fine = fine_rows(scene.views, q).astype(float)
    rows, width = space.rows, space.width
    costs = np.full((space.planes, rows, width), np.inf)
    evaluations = 0
    for k in range(space.planes):
        for y in range(rows):
            for x in range(width):
                ys = np.arange(max(0, y - radius), min(rows, y + radius + 1))[:, None]
                xs = np.arange(max(0, x - radius), min(width, x + radius + 1)) * q
                terms = []
                for j in range(scene.n):
                    there = xs - (j - scene.ref) * (space.first + k)
                    if j != scene.ref and there.min() >= 0 and there.max() < space.samples:
                        difference = fine[scene.ref][:, ys, xs] - fine[j][:, ys, there]
                        terms.append((difference**2).sum())
                evaluations += len(terms)
                if terms:
                    costs[k, y, x] = np.mean(terms)
    disparity = np.full((rows, width), np.nan)
    for y in range(rows):
        for x in range(width):
            cost = costs[:, y, x]
            if np.isfinite(cost).any():
                k = int(cost.argmin())
                offset = 0.0
                if 0 < k < space.planes - 1 and np.isfinite(cost[k - 1 : k + 2]).all():
                    curvature = cost[k - 1] - 2 * cost[k] + cost[k + 1]
                    offset = (cost[k - 1] - cost[k + 1]) / 2 / curvature if curvature > 0 else 0.0
                disparity[y, x] = (space.first + k + offset) / q
    return disparity, evaluations


@settings(max_examples=25, deadline=None)
@given(
    n=st.integers(2, 4),
    rows=st.integers(1, 5),
    width=st.integers(1, 9),
    least=st.integers(-3, 2),
    planes=st.integers(0, 4),
    fineness=st.integers(1, 3),
    window=st.sampled_from([1, 3, 5]),
    seed=st.integers(0, 999),
)
def test_agrees_with_its_slow_twin(
    n: int, rows: int, width: int, least: int, planes: int, fineness: int, window: int, seed: int
) -> None:
    scene = scene_of(noise((n, rows, width, 3), seed), least, least + planes, ref=seed % n)
    method = OkutomiKanade(window=window, fineness=fineness)
    estimate = method.solve(scene, Context())
    expected, evaluations = slow(scene, method)
    np.testing.assert_allclose(estimate.disparity[scene.ref], expected, atol=2e-3)
    assert estimate.work["ssd_evaluations"] == evaluations


@pytest.mark.parametrize("disparity", [-3, -1, 0, 2, 4])
@pytest.mark.parametrize("ref", [0, 1, 3])
def test_wall_is_found_where_a_view_shows_it(disparity: int, ref: int) -> None:
    scene = scene_of(plane_scene(disparity, ref=ref), -4, 5, ref=ref)
    found = OkutomiKanade(window=5).solve(scene, Context()).disparity[ref]
    inside = found[:, 10:-10] if ref in (0, 3) else found  # the outer views see one side of it alone
    np.testing.assert_allclose(inside, disparity, atol=0.1)


def test_box_before_wall_away_from_its_outline() -> None:
    wall, box = noise((30, 90, 3), 1), noise((30, 90, 3), 2)
    x, views = np.arange(60), []
    for j in range(4):
        on_box = x + (j - 1) * 4
        covered = (on_box >= 20) & (on_box < 40) & (np.arange(30)[:, None] >= 10)
        views.append(np.where(covered[..., None], box[:, on_box + 10], wall[:, x + (j - 1) + 10]))
    found = OkutomiKanade(window=5).solve(scene_of(np.stack(views), 0, 6, ref=1), Context()).disparity[1]
    np.testing.assert_allclose(found[13:, 23:37], 4, atol=0.1)
    np.testing.assert_allclose(found[:7], 1, atol=0.1)
    np.testing.assert_allclose(found[13:, 45:], 1, atol=0.1)


@pytest.mark.parametrize(
    ("disparity", "fineness", "atol"), [(1.5, 2, 0.02), (2.3, 1, 0.15), (2.3, 4, 0.02), (-0.75, 4, 0.02)]
)
def test_sub_pixel(disparity: float, fineness: int, atol: float) -> None:
    scene = scene_of(smooth_scene(disparity), -4, 4, ref=2)
    found = OkutomiKanade(fineness=fineness).solve(scene, Context()).disparity[2]
    np.testing.assert_allclose(found[:, 15:-15], disparity, atol=atol)


def test_fewer_views_answer_in_the_steps_of_the_scene() -> None:
    scene = scene_of(smooth_scene(1.5), 0, 3, ref=2, pair_steps=2)
    estimate = OkutomiKanade(views=3).solve(scene, Context())
    assert scene.widest(3) == (0, 2, 4)
    np.testing.assert_allclose(estimate.disparity[2][:, 15:-15], 1.5, atol=0.02)


def test_no_view_holds_the_window() -> None:
    found = OkutomiKanade().solve(scene_of(noise((3, 4, 6, 3), 0), 9, 12), Context()).disparity[0]
    assert found.shape == (4, 6)
    assert np.isnan(found).all()


def test_of_equal_minima_the_farthest() -> None:
    scene = scene_of(np.full((3, 8, 30, 3), 77, np.uint8), -2, 5, ref=1)
    np.testing.assert_array_equal(OkutomiKanade().solve(scene, Context()).disparity[1], -2)


@pytest.mark.parametrize("shape", [(1, 1), (1, 12), (12, 1), (2, 3)])
def test_tiny_images(shape: tuple[int, int]) -> None:
    found = OkutomiKanade().solve(scene_of(noise((2, *shape, 3), 3), -2, 20), Context()).disparity[0]
    assert found.shape == shape
    assert np.isfinite(found).all()  # plane 0 is always in view


def test_threads_and_repetition_change_nothing() -> None:
    scene = scene_of(noise((4, 70, 40, 3), 5), -1, 6, ref=1, pair_steps=2)
    before = scene.views.copy()
    once, again, threaded = (OkutomiKanade().solve(scene, Context(threads=t)) for t in (1, 1, 2))
    np.testing.assert_array_equal(once.disparity[1], again.disparity[1])
    np.testing.assert_array_equal(once.disparity[1], threaded.disparity[1])
    assert once.work == threaded.work
    np.testing.assert_array_equal(scene.views, before)


@pytest.mark.parametrize(
    "wrong",
    [{"window": 4}, {"window": -1}, {"views": 1}, {"views": -2}, {"fineness": -1}, {"fineness": 65}, {"window": 101}],
)
def test_wrong_parameters(wrong: dict[str, int]) -> None:
    with pytest.raises(ValueError, match=next(iter(wrong))):
        OkutomiKanade(**wrong)
