"""Cameras that are not perfect."""

import numpy as np
import pytest
from rigs import SMALL

from matbench.datasets.synthetic import SYNTHETIC
from matbench.datasets.synthetic.cameras import Strengths, exposed, heights


@pytest.mark.parametrize(
    ("option", "level"), [("gain", "0.3"), ("bias", "20"), ("vignetting", "0.5"), ("blur", "2"), ("highlight", "90")]
)
def test_cameras_change_pictures_only(option: str, level: str) -> None:
    clean, changed = (SYNTHETIC.load("box", SMALL | {"noise": "0"} | more, None) for more in ({}, {option: level}))
    assert changed.digest != clean.digest
    for view in range(5):
        np.testing.assert_array_equal(changed.truth[view], clean.truth[view])
        np.testing.assert_array_equal(changed.visible[view], clean.visible[view])


def _clean_and(**strengths: float) -> tuple[np.ndarray, list[np.ndarray]]:
    """A grey picture, and what five cameras make of it."""
    picture = np.random.default_rng(0).uniform(60, 140, (90, 120, 3)).astype(np.float32)
    views = [exposed(picture, Strengths(noise=0, **strengths), 3, view, 5) for view in range(5)]
    return picture.astype(float), [v.astype(float) for v in views]


def test_gain_and_bias_differ_from_camera_to_camera() -> None:
    picture, views = _clean_and(gain=0.3)
    gains = [float((v * picture).sum() / (picture**2).sum()) for v in views]
    assert max(abs(g - 1) for g in gains) == pytest.approx(0.3, abs=1e-3)
    assert len({round(g, 3) for g in gains}) == 5
    picture, views = _clean_and(bias=20)
    biases = [float((v - picture).mean()) for v in views]
    assert max(map(abs, biases)) == pytest.approx(20, abs=0.02)
    assert np.corrcoef(gains, biases)[0, 1] < 0.99, "each is drawn for itself"


def test_vignetting_darkens_corners_and_blur_smooths() -> None:
    picture, views = _clean_and(vignetting=0.4)
    assert views[0][0, 0] / picture[0, 0] == pytest.approx(0.6, abs=0.01)
    assert views[4][45, 60] / picture[45, 60] == pytest.approx(1, abs=0.01)
    picture, views = _clean_and(blur=2)
    # white noise keeps 1 / (4 pi sigma^2) of its variance
    assert views[2][10:-10, 10:-10].var() / picture.var() == pytest.approx(1 / (16 * np.pi), rel=0.1)
    assert views[2].mean() == pytest.approx(picture.mean(), abs=0.2)


def test_misaligned_views_stay_exact() -> None:
    options = SMALL | {"noise": "0"}
    straight, crooked = (SYNTHETIC.load("spheres", options | more, None) for more in ({}, {"misaligned": "3"}))
    lower = heights(Strengths(misaligned=3), 0, 5)
    assert max(map(abs, lower)) == 3
    view = int(np.argmax(np.abs(lower)))
    shift = round(lower[view])
    rows = np.arange(10, 80)
    np.testing.assert_array_equal(crooked.truth[view][rows + shift], straight.truth[view][rows])
    np.testing.assert_array_equal(crooked.views[view][rows + shift], straight.views[view][rows])
    # in the reference view the rows that another camera misses are not seen there
    gone = int(np.ceil(abs(lower[view] - lower[2]) - 0.5))
    ends = crooked.visible[2][view][-gone:] if lower[view] > lower[2] else crooked.visible[2][view][:gone]
    assert not ends.any()


def test_noise_has_the_deviation_asked_for() -> None:
    clean, noisy = (SYNTHETIC.load("weak", SMALL | {"noise": level}, None) for level in ("0", "4"))
    difference = noisy.views.astype(float) - clean.views
    assert difference.std() == pytest.approx(4, abs=0.15)
    assert abs(difference.mean()) < 0.1
    assert difference[0].tobytes() != difference[1].tobytes()
