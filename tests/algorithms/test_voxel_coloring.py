"""Voxel colouring against a plain NumPy twin and on scenes whose answer is known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.stats import chi2

from matbench.algorithm import Context
from matbench.algorithms.sampling import fine_rows, search_space
from matbench.algorithms.voxel_coloring import SpaceCarving, VoxelColoring, carve
from matbench.parameters import silent_in
from matbench.scene import Range, Scene
from matbench.space import DisparitySpace, visibility


def scene_of(views: NDArray[np.uint8], least: float, largest: float, ref: int = 0, pair_steps: float = 1) -> Scene:
    return Scene("test", views, tuple(map(str, range(len(views)))), ref, Range(least, largest), {}, pair_steps)


def noise(shape: tuple[int, ...], seed: int, top: int = 256) -> NDArray[np.uint8]:
    return np.random.default_rng(seed).integers(0, top, shape, dtype=np.uint8)


def box_before_wall(wall: int, box: int, n: int = 4, ref: int = 1) -> tuple[NDArray[np.uint8], NDArray[np.int64]]:
    """(n, 12, 40, 3) noisy views of a box before a wall, and for every view its (12, 40) disparities."""
    height, width, reach = 12, 40, 40
    far, near = noise((height, width + 2 * reach, 3), 1), noise((height, width + 2 * reach, 3), 2)
    views, truth = np.empty((n, height, width, 3), np.uint8), np.empty((n, height, width), np.int64)
    columns = np.arange(width)
    for j in range(n):
        on_wall, on_box = columns + (j - ref) * wall, columns + (j - ref) * box  # columns of the reference view
        covered = np.zeros((height, width), bool)
        covered[3:9] = (on_box >= 15) & (on_box < 25)
        views[j] = np.where(covered[..., None], near[:, on_box + reach], far[:, on_wall + reach])
        truth[j] = np.where(covered, box, wall)
    return views, truth


def slow(scene: Scene, method: VoxelColoring) -> tuple[NDArray[np.float32], NDArray[np.float32], int]:
    """Disparities, occupancy and number of tested voxels, voxel by voxel in float64."""
    space = search_space(scene, method.fineness)
    q, radius = space.fineness, method.window // 2
    images = fine_rows(scene.views, q).astype(float)
    marked = np.zeros((space.views, space.rows, space.samples), bool)
    occupied = np.zeros(space.shape, np.float32)
    disparity = np.full((space.rows, space.width), np.nan, np.float32)
    tested = 0

    def unmarked(y: int, column: int, plane: int) -> list[tuple[int, int]]:
        """The views that hold this voxel and have its sample unmarked, each with the sample."""
        samples = [(i, column - space.start(i, plane)) for i in range(space.views)]
        return [(i, u) for i, u in samples if 0 <= u < space.samples and not marked[i, y, u]]

    for plane in reversed(range(space.planes)):
        for y in range(space.rows):
            for column in range(space.columns):
                if len(unmarked(y, column, plane)) < 2:
                    held = any(0 <= column - space.start(i, plane) < space.samples for i in range(space.views))
                    occupied[y, plane, column] = held and method.unseen == "keep"
                    continue
                tested += 1
                squares = freedom = 0.0
                for dy in range(-radius, radius + 1):
                    for dx in range(-radius, radius + 1):
                        if 0 <= y + dy < space.rows and 0 <= column + dx * q < space.columns:
                            seen = unmarked(y + dy, column + dx * q, plane)
                            if len(seen) >= 2:
                                colours = np.array([images[i, :, y + dy, u] for i, u in seen])
                                squares += ((colours - colours.mean(axis=0)) ** 2).sum()
                                freedom += 3 * (len(seen) - 1)
                if method.rule == "threshold":
                    occupied[y, plane, column] = np.sqrt(squares / freedom) <= method.threshold
                else:
                    likely = chi2.cdf(squares / method.noise**2, freedom)
                    occupied[y, plane, column] = likely <= 1 - method.significance
        for y, column in zip(*np.nonzero(occupied[:, plane]), strict=True):
            for i, u in unmarked(y, column, plane):
                marked[i, y, u] = True
                if i == scene.ref and u % q == 0:
                    disparity[y, u // q] = space.disparities[plane]
    return disparity, occupied, tested


@settings(max_examples=20, deadline=None)
@given(
    n=st.integers(2, 4),
    rows=st.integers(1, 4),
    width=st.integers(1, 6),
    least=st.integers(-2, 1),
    planes=st.integers(0, 2),
    method=st.builds(
        VoxelColoring,
        fineness=st.integers(1, 3),
        window=st.sampled_from([1, 3]),
        rule=st.sampled_from(["threshold", "chi_squared"]),
        unseen=st.sampled_from(["empty", "keep"]),
        threshold=st.just(11.123),
        noise=st.just(9.87),
    ),
    seed=st.integers(0, 999),
)
def test_agrees_with_its_slow_twin(
    n: int, rows: int, width: int, least: int, planes: int, method: VoxelColoring, seed: int
) -> None:
    scene = scene_of(noise((n, rows, width, 3), seed, top=40), least, least + planes, ref=seed % n)
    estimate = method.solve(scene, Context())
    disparity, occupied, tested = slow(scene, method)
    assert estimate.volume is not None
    np.testing.assert_array_equal(estimate.volume.values, occupied)
    np.testing.assert_array_equal(estimate.disparity[scene.ref], disparity)
    counted = {"voxels_tested": tested, "voxels_coloured": int(occupied.sum()), "volume_bytes": 4 * occupied.size}
    assert estimate.work == counted


@pytest.mark.parametrize(("wall", "box"), [(1, 4), (-3, -1), (-1, 2)])
@pytest.mark.parametrize("ref", [0, 1, 3])
def test_box_before_wall_is_exact_wherever_two_views_see_it(wall: int, box: int, ref: int) -> None:
    views, truth = box_before_wall(wall, box, ref=ref)
    found = VoxelColoring(threshold=0, window=1).solve(scene_of(views, -4, 5, ref=ref), Context()).disparity[ref]
    n, height, width = truth.shape
    y, x = np.mgrid[:height, :width]
    seen = np.zeros((height, width), int)
    for j in range(n):
        there = x - (j - ref) * truth[ref]
        inside = (there >= 0) & (there < width)
        seen += inside & (truth[j, y, np.clip(there, 0, width - 1)] == truth[ref])
    np.testing.assert_array_equal(found, np.where(seen >= 2, truth[ref], np.nan))


def test_marks_hide_what_is_behind() -> None:
    """Behind a coloured front of constant colour nothing is tested: every ray is opaque once."""
    scene = scene_of(np.full((3, 5, 20, 3), 90, np.uint8), 0, 4, ref=1)
    estimate = VoxelColoring().solve(scene, Context())
    assert estimate.volume is not None
    space, values = estimate.volume.space, estimate.volume.values
    rays = np.zeros((3, 5, 20))
    for view in range(3):
        for plane in range(space.planes):
            ray = space.frustum(view, plane)
            seen = visibility(estimate.volume, view)[:, plane, ray]
            rays[view] += seen * values[:, plane, ray]
    np.testing.assert_array_equal(rays[1], 1)
    assert rays.max() == 1
    np.testing.assert_array_equal(estimate.disparity[1], 4)  # the nearest plane, since all agree


def test_all_tests_of_a_plane_come_before_its_marks() -> None:
    """On a wall of one plane, marks made while testing would leave the windows without views."""
    texture = noise((6, 30, 3), 4)
    views = np.stack([texture[:, 2 * j : 2 * j + 20] for j in range(3)])
    found = VoxelColoring(threshold=0, window=3).solve(scene_of(views, 2, 2, ref=1), Context()).disparity[1]
    np.testing.assert_array_equal(found, 2)


def test_holes_on_request() -> None:
    views, truth = box_before_wall(1, 4, ref=0)
    scene = scene_of(views, 0, 5, ref=0)
    sparse = VoxelColoring(threshold=0, window=1).solve(scene, Context()).disparity[0]
    full = VoxelColoring(threshold=0, window=1, fill=True).solve(scene, Context()).disparity[0]
    known = ~np.isnan(sparse)
    assert not known.all()
    np.testing.assert_array_equal(full[known], sparse[known])
    np.testing.assert_array_equal(full, truth[0])


def test_fewer_views_answer_in_the_steps_of_the_scene() -> None:
    texture = noise((6, 60, 3), 4)
    views = np.stack([texture[:, 2 * j : 2 * j + 40] for j in range(5)])
    estimate = VoxelColoring(threshold=0, views=3).solve(scene_of(views, 0, 3, ref=2), Context())
    assert estimate.volume is not None
    assert estimate.volume.views == (0, 2, 4)
    np.testing.assert_array_equal(estimate.disparity[2], 2)


@pytest.mark.parametrize("shape", [(1, 1), (1, 12), (12, 1), (2, 3)])
def test_tiny_images(shape: tuple[int, int]) -> None:
    scene = scene_of(noise((2, *shape, 3), 3), -2, 20, pair_steps=2)
    assert VoxelColoring().solve(scene, Context()).disparity[0].shape == shape


def test_nothing_agrees() -> None:
    estimate = VoxelColoring(threshold=0, fill=True).solve(scene_of(noise((3, 6, 9, 3), 0), 0, 2), Context())
    assert np.isnan(estimate.disparity[0]).all()


def test_threads_and_repetition_change_nothing() -> None:
    scene = scene_of(noise((4, 70, 40, 3), 5, top=30), -1, 6, ref=1, pair_steps=2)
    before = scene.views.copy()
    once, again, threaded = (VoxelColoring(threshold=8).solve(scene, Context(threads=t)) for t in (1, 1, 2))
    for other in (again, threaded):
        np.testing.assert_array_equal(once.disparity[1], other.disparity[1])
        assert once.volume is not None
        assert other.volume is not None
        np.testing.assert_array_equal(once.volume.values, other.volume.values)
        assert once.work == other.work
        assert 0 < once.volume.values.mean() < 1
    np.testing.assert_array_equal(scene.views, before)


def rendered(seed: int, share: float) -> tuple[Scene, NDArray[np.float32]]:
    """Views of random voxels, all of different colours, and the voxels; the farthest plane is full."""
    space = DisparitySpace(3, 5, 14, 0, 4)
    rng = np.random.default_rng(seed)
    solid = (rng.random(space.shape) < share).astype(np.float32)
    solid[:, 0] = 1
    number = np.arange(solid.size).reshape(solid.shape)
    colours = rng.permutation(256**3)[number]
    ids = np.zeros((space.views, space.rows, space.width), np.int64)
    for view in range(space.views):
        for plane in range(space.planes):  # what is nearer comes later
            ray = space.frustum(view, plane)
            ids[view] = np.where(solid[:, plane, ray] > 0, colours[:, plane, ray], ids[view])
    views = np.stack([ids >> 16, ids >> 8 & 255, ids & 255], axis=-1).astype(np.uint8)
    return Scene("voxels", views, ("0", "1", "2"), 1, Range(0, 4), {}, 1), solid


@pytest.mark.parametrize("share", [0.05, 0.3])
@pytest.mark.parametrize("seed", [0, 1])
def test_the_hull_contains_what_the_views_show(seed: int, share: float) -> None:
    scene, solid = rendered(seed, share)
    hull = SpaceCarving(threshold=0, window=1).solve(scene, Context()).volume
    assert hull is not None
    held = np.zeros(hull.space.shape, bool)
    for view, plane in np.ndindex(hull.space.views, hull.space.planes):
        held[:, plane, hull.space.frustum(view, plane)] = True
    assert (hull.values[held] >= solid[held]).all()
    assert not hull.values[~held].any()
    assert hull.values[held].mean() < 1  # something was carved
    coloured = VoxelColoring(threshold=0, window=1).solve(scene, Context()).volume
    assert coloured is not None
    assert (coloured.values < solid).any()  # what one view only sees is lost there


@pytest.mark.parametrize(("window", "threshold"), [(1, 0.0), (3, 8.0)])
def test_a_second_sweep_changes_nothing(window: int, threshold: float) -> None:
    scene = scene_of(noise((4, 8, 30, 3), 5, top=30), -1, 4, ref=1) if threshold else rendered(3, 0.2)[0]
    space = search_space(scene)
    limits = (threshold**2 * np.arange(9 * window**2 + 1)).astype(np.float32)
    solid = np.ones(space.shape, np.float32)
    first, _ = carve(scene, space, solid, window, limits, keep=True)
    once = solid.copy()
    again, _ = carve(scene, space, solid, window, limits, keep=True)
    np.testing.assert_array_equal(solid, once)
    np.testing.assert_array_equal(first, again)
    assert 0 < once.mean() < 1


def test_a_voxel_is_surer_the_better_its_colours_agree() -> None:
    scene, least = rendered(3, 0.2)[0], 40.0
    method = VoxelColoring(threshold=least, window=1, fill=False)
    estimate = method.solve(scene, Context())
    found, sure = estimate.disparity[scene.ref], estimate.confidence[scene.ref]
    assert (sure[np.isnan(found)] == 0).all()
    assert 0 <= sure.min() < sure.max() <= 1
    # the nearest plane of all, where every view still sees everything: by hand
    space = search_space(scene)
    whole = [
        (y, x)
        for y, x in zip(*np.nonzero(found == space.disparities[-1]), strict=True)
        if all(0 <= x - (j - scene.ref) * space.last < scene.width for j in range(scene.n)) and space.fineness == 1
    ]
    assert len(whole) >= 5
    for y, x in whole:
        colours = [scene.views[j, y, x - (j - scene.ref) * space.last].astype(float) for j in range(scene.n)]
        squares = ((colours - np.mean(colours, axis=0)) ** 2).sum()
        assert sure[y, x] == pytest.approx(1 - squares / (least**2 * 3 * (scene.n - 1)), abs=1e-4)


def test_carving_is_colouring_that_keeps_what_is_unseen() -> None:
    scene = scene_of(noise((4, 9, 30, 3), 5, top=30), -1, 4, ref=1)
    carved, kept = SpaceCarving().solve(scene, Context()), VoxelColoring(unseen="keep").solve(scene, Context())
    assert carved.volume is not None
    assert kept.volume is not None
    np.testing.assert_array_equal(carved.volume.values, kept.volume.values)
    assert carved.work == kept.work


@pytest.mark.parametrize("deviation", [2.0, 6.0])
def test_noise_decides_by_itself_what_is_consistent(deviation: float) -> None:
    texture = np.random.default_rng(1).integers(20, 236, (30, 60, 3)).repeat(2, axis=1)[:, :90]
    clean = np.stack([texture[:, 2 * j : 2 * j + 60] for j in range(4)])
    views = np.clip(np.rint(clean + np.random.default_rng(2).normal(0, deviation, clean.shape)), 0, 255).astype(
        np.uint8
    )
    scene = scene_of(views, 2, 2, ref=1)
    found = VoxelColoring(rule="chi_squared", window=1, significance=0.05, noise=deviation).solve(scene, Context())
    turned_away = np.isnan(found.disparity[1]).mean()
    assert 0.02 < turned_away < 0.1
    strict = VoxelColoring(rule="chi_squared", window=1, noise=deviation / 3).solve(scene, Context())
    assert np.isnan(strict.disparity[1]).mean() > 0.5


def test_what_is_not_read_is_said() -> None:
    assert set(silent_in(VoxelColoring())) == {"noise", "significance"}
    assert set(silent_in(SpaceCarving(rule="chi_squared"))) == {"threshold"}


@pytest.mark.parametrize("wrong", [{"threshold": -1}, {"window": 2}, {"views": 1}, {"fineness": -1}])
def test_wrong_parameters(wrong: dict[str, int]) -> None:
    with pytest.raises(ValueError, match=next(iter(wrong))):
        VoxelColoring(**wrong)  # type: ignore[arg-type]
