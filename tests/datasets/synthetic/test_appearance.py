"""What was measured of real scenes is read."""

import pytest

from matbench.datasets.synthetic.appearance import PER_SCENE, Patch, appearance
from matbench.datasets.synthetic.make_appearance import SCENES


def test_patches_are_read_by_their_names() -> None:
    found = appearance()
    assert len(found.patches) == PER_SCENE * len(SCENES)
    assert all(0 < patch.brightness < 255 and patch.fine <= patch.contrast + 0.1 for patch in found.patches)
    assert len(found.noise) == len(SCENES)
    assert all(0.05 < noise < 3 for noise in found.noise)
    assert all(0.1 < blur < 1.5 for blur in found.blur)


def test_a_patch_has_the_colour_that_its_numbers_say() -> None:
    colour = Patch(100.0, 20.0, -5.0, 10.0, 2.0, 3.0).colour
    assert colour == (120.0, 85.0, 95.0)
    assert sum(colour) / 3 == pytest.approx(100.0)
