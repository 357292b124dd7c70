"""What images tell of themselves."""

import numpy as np
import pytest

from matbench import load_scene
from matbench.datasets.measuring import _positions, measure


@pytest.mark.parametrize(
    ("places", "step", "positions"),
    [
        ([0, 1.1, 2], 1, ()),
        ([0, 2 / 3 + 0.004, 2], 2 / 3, (0, 1, 3)),
        ([0, 0.8, 2.0], 0.8, (0, 1, 2.5)),
        ([0, 1.2, 2.0], 0.8, (0, 1.5, 2.5)),
        ([0, 0.62, 2], 0.62, (0, 1, 3.226)),
        ([0, 1.5, 2, 3], 0.5, (0, 3, 4, 6)),
    ],
)
def test_positions_are_in_steps_beside_the_middle_view(
    places: list[float], step: float, positions: tuple[float, ...]
) -> None:
    found = _positions(np.array(places))
    assert found[0] == pytest.approx(step, abs=0.01)
    assert found[1] == pytest.approx(positions, abs=0.002)


def test_where_the_middle_image_is_no_view_another_is_asked() -> None:
    scene = load_scene("synthetic/box[n=4 size=240x180]")
    images = {f"{k}": view for k, view in enumerate(scene.views)}
    found = measure({"0": images["0"], "1": images["1"], "map": images["2"] // 64 * 64, "3": images["3"]})
    assert found.names in (("0", "1", "map", "3"), ("0", "1", "3"))
    flat = np.zeros_like(images["0"])
    assert measure({"0": images["0"], "map": flat, "1": images["1"]}).names == ("0", "1")


def test_without_features_all_stay_in_their_order() -> None:
    blank = {name: np.full((40, 50, 3), 9, np.uint8) for name in "abc"}
    found = measure(blank)
    assert (found.names, found.disparities, found.positions, found.vertical) == (("a", "b", "c"), None, (), False)
    assert found.remarks == ["the order of the views is that of their names: too few features match to measure it"]
