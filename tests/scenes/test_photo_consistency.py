"""Warping by the truth: against a loop over pixels, and on scenes that are and are not what they say."""

import numpy as np
import pytest
from attrs import evolve
from real import Real
from scene_files import Layers

from matbench import load_scene
from matbench.measures.warping import picture_columns, warped
from matbench.regions import points_seen
from matbench.scene import Range, Scene
from matbench.scenes.photo_consistency import left_over, together, warping_errors


def _scene(n: int = 5, near: float = 6.0, far: float = 2.0, pair_steps: float = 1) -> Scene:
    world, ref = Layers(near=near, far=far), n // 2
    views = np.stack([world.view(k - ref) for k in range(n)])
    labels = tuple(map(str, range(n)))
    return Scene("layers", views, labels, ref, Range(far - 1, near + 1), {ref: world.truth()}, pair_steps)


def test_errors_are_the_mean_and_median_over_seen_pixels() -> None:
    scene = _scene()
    truth, shifts = scene.truth[2], (-1.0, 0.0, 1.0)
    for view, error in warping_errors(scene, shifts=shifts).items():
        steps = view - 2
        pictures = [warped(scene.views[view], truth + np.float32(shift), steps) for shift in shifts]
        seen = points_seen(truth, steps) & ~np.isnan(pictures).any(axis=(0, 3))
        for k, picture in enumerate(pictures):
            difference = np.abs(picture - scene.views[2])[seen].mean(axis=1)
            assert error.mean[k] == pytest.approx(difference.mean(), rel=1e-5)
            assert error.median[k] == pytest.approx(np.median(difference), rel=1e-5)
        assert error.pixels == seen.sum()


def test_the_truth_explains_and_its_neighbours_do_not() -> None:
    error = together(warping_errors(_scene()))
    assert error is not None
    assert error.at(0) < 0.3 * min(error.at(-1), error.at(1))
    wrong = together(warping_errors(_scene(), _scene().truth[2] + np.float32(1)))
    assert wrong is not None
    assert wrong.at(-1) < 0.3 * wrong.at(0)


def test_black_borders_are_no_picture() -> None:
    scene = _scene()
    views = scene.views.copy()
    views[1, :, :7] = views[4, :, 90:] = views[2, :, :3] = 0
    assert [picture_columns(view) for view in views] == [(0, 95), (7, 95), (3, 95), (0, 95), (0, 89)]
    assert picture_columns(np.zeros((2, 9, 3), np.uint8)) == (0, 8)
    clean, black = warping_errors(scene), warping_errors(evolve(scene, views=views))
    for view in clean:
        assert black[view].at(0) == pytest.approx(clean[view].at(0), rel=0.15)
    assert np.isnan(left_over(evolve(scene, views=views))[:, :3]).all()


def test_a_shift_is_a_pixel_of_the_pair() -> None:
    each = [
        together(warping_errors(_scene(pair_steps=steps), shifts=(shift,))) for steps, shift in ((1, 0.5), (2, 1.0))
    ]
    assert each[0] is not None
    assert each[1] is not None
    assert each[0].mean == each[1].mean


def test_visibility_that_is_known_is_used() -> None:
    scene = _scene()
    nothing = np.zeros((5, *scene.truth[2].shape), bool)
    assert warping_errors(evolve(scene, visible={2: nothing})) == {}
    assert together({}) is None
    assert np.isnan(left_over(evolve(scene, visible={2: nothing}))).all()


def test_what_is_left_over_is_where_the_truth_is_wrong() -> None:
    scene = _scene()
    truth = scene.truth[2].copy()
    truth[20:40, 10:25] += 3
    truth[50:60] = np.nan
    left = left_over(evolve(scene, truth={2: truth}))
    assert np.isnan(left[50:60]).all()
    assert np.nanmean(left[20:40, 12:24]) > 5 * np.nanmean(left[20:40, 70:])


@pytest.mark.parametrize(
    "name",
    [
        "middlebury2001/tsukuba",
        "middlebury2001/sawtooth",
        "middlebury2001/venus",
        "middlebury2003/teddy",
        "middlebury2003/teddy[size=half]",
        "middlebury2005/Reindeer[size=half]",
        "middlebury2006/Aloe[size=half]",
        "middlebury2006/Aloe",
        "middlebury2006/Baby1",
        "middlebury2006/Bowling1",
        "middlebury2006/Cloth1",
        "middlebury2006/Lampshade1",
        "middlebury2006/Plastic",
        "middlebury2006/Rocks1",
        "hci/antinous",
    ],
)
def test_every_real_truth_explains_its_images(real: Real, name: str) -> None:
    """In both views that have truth; every third row. (Full-size Reindeer, left out for its size, is explained too.)"""
    scene = load_scene(name, real(name))
    for view, truth in scene.truth.items():
        thin = evolve(scene, ref=view, views=scene.views[:, ::3], truth={view: truth[::3]}, regions={})
        error = together(warping_errors(thin))
        assert error is not None
        assert error.at(0) < min(error.at(-1), error.at(1)), (name, view, error)
