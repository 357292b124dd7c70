"""What the worlds hold is what their names promise."""

import numpy as np
import pytest
from rigs import SMALL

from matbench.datasets.synthetic import SYNTHETIC, WORLDS
from matbench.scene import Scene

DIGESTS = {"box": "45b2409079e539e4", "curved": "fc74608f94a75284", "weak": "3b472ae62c13c112"}


@pytest.fixture(scope="module", params=sorted(WORLDS))
def scene(request: pytest.FixtureRequest) -> Scene:
    return SYNTHETIC.load(request.param, SMALL, None)


def test_default_scenes_have_what_their_names_promise() -> None:
    scenes = {name: SYNTHETIC.load(name, {}, None) for name in WORLDS}
    shares = {name: s.regions["textureless"].mean() for name, s in scenes.items()}
    assert shares["weak"] > 0.6
    assert max(shares["box"], shares["curved"]) < 0.15
    assert scenes["curved"].truth[2].min() < 0 < scenes["curved"].truth[2].max()
    assert all(s.views.shape == (5, 180, 240, 3) for s in scenes.values())
    assert all(s.regions["occ"].mean() > 0.02 for s in scenes.values())
    assert {name: scenes[name].digest[:16] for name in DIGESTS} == DIGESTS
    assert not any(_faces_the_cameras(scenes[name]).any() for name in ("slanted", "spheres"))
    assert _faces_the_cameras(scenes["layers"]).mean() > 0.9
    assert scenes["layers"].truth[2].max() > 4 * scenes["layers"].truth[2].min()
    assert np.diff(scenes["steps"].truth[2], axis=1).max() * 2 > 20, "px of the pair"
    widths = _widths(scenes["thin"].truth[2] > 3)
    assert widths.min() == 1
    assert np.median(widths) <= 3
    fence = scenes["fence"].truth[2][60] > 3
    starts = np.flatnonzero(np.diff(fence.astype(int)) == 1)
    assert len(starts) == 23
    assert set(np.diff(starts)) == {7, 8}
    upright = _widths((scenes["fence"].truth[2] > 3)[:, starts[10] + 1][None])
    assert len(upright) == 7, "one picket and, below it, the rails, across which the column runs"
    assert upright[0] >= 76
    assert set(upright[1:]) <= {3, 4}


def _faces_the_cameras(scene: Scene) -> np.ndarray:
    """Where disparity is the same all around."""
    truth = scene.truth[scene.ref]
    return np.ptp(np.lib.stride_tricks.sliding_window_view(truth, (3, 3)), axis=(2, 3)) == 0


def _widths(mask: np.ndarray) -> np.ndarray:
    """Lengths of the runs of True in the rows."""
    edges = np.diff(np.pad(mask.astype(int), ((0, 0), (1, 1))), axis=1)
    return np.nonzero(edges == -1)[1] - np.nonzero(edges == 1)[1]
