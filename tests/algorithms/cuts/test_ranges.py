"""Ranges of colours against a slow twin, and that they do not mind where pixels lie."""

import numpy as np
import pytest
from attrs import evolve
from boxes import box_before_wall

from matbench.algorithms.cuts.ranges import MOST, Ranges
from matbench.algorithms.sweep import Costs, Sweep


def around(image, y, x, c, width):
    """The colours of a pixel and of the places half-way to its neighbours in the picture."""
    own = float(image[c, y, x])
    near = [(y - 1, x), (y + 1, x), (y, x - 1), (y, x + 1)]
    inside = [(a, b) for a, b in near if 0 <= a < image.shape[1] and 0 <= b < width]
    return [own, *((own + float(image[c, a, b])) / 2 for a, b in inside)]


def twin(one, other, y, x, at, phase):
    """How far each colour is from the other's range, the nearer of both ways, squared, over the colours."""
    gaps = []
    for c in range(3):
        ways = []
        inside = one.shape[2] - (phase > 0)  # between pixels there is one place less in a row
        ends = ((one, x, one.shape[2]), (other, at, inside))
        for (image, column, _), (beside, there, width) in (ends, ends[::-1]):
            value, found = float(image[c, y, column]), around(beside, y, there, c, width)
            ways.append(max(0.0, value - max(found), min(found) - value))
        gaps.append(min(*ways, MOST) ** 2)
    return np.mean(gaps)


@pytest.mark.parametrize("fineness", [1, 2])
def test_a_colour_differs_by_how_far_it_is_from_the_others_range(fineness):
    scene = box_before_wall(n=3, height=6, width=20)
    noisy = np.random.default_rng(0).normal(scene.views, 30).clip(0, 255).astype(np.uint8)
    sweep = Sweep.of(evolve(scene, views=noisy), Costs(fineness=fineness))
    ranges, ref = Ranges.of(sweep.phases), scene.ref
    differences = []
    for view in sweep.others:
        for plane in range(sweep.space.planes):
            found = ranges.difference(sweep, view, plane)
            here, phase, there = sweep.homologues(view, plane)
            assert np.isnan(np.delete(found, np.r_[here], axis=1)).all()
            one, other = sweep.phases[ref, 0], sweep.phases[view, phase]
            for y, x in np.ndindex(found.shape):
                if here.start <= x < here.stop:
                    at = there.start + x - here.start
                    assert found[y, x] == pytest.approx(twin(one, other, y, x, at, phase), abs=0.01)
                    differences.append(found[y, x])
    assert min(differences) == 0
    assert max(differences) > 100


def test_half_a_pixel_more_or_less_changes_nothing_of_a_smooth_picture():
    x = np.arange(40)
    waves = [100 + 60 * np.sin(2 * np.pi * (x + shift) / 16) for shift in (0.0, 0.5)]
    one, other = (np.broadcast_to(wave, (3, 4, 40)).astype(np.float32) for wave in waves)
    ranges = Ranges.of(np.stack([one, other])[:, None])
    gaps = np.maximum(one - ranges.largest[1, 0], ranges.least[1, 0] - one)
    back = np.maximum(other - ranges.largest[0, 0], ranges.least[0, 0] - other)
    assert np.abs(one - other).max() > 11
    assert np.minimum(gaps, back)[:, :, 1:-1].max() < 0.6


@pytest.mark.parametrize("fineness", [1, 2])
def test_in_a_mirror_ranges_are_mirrored(fineness):
    views = np.random.default_rng(0).integers(0, 256, (3, 5, 12, 3)).astype(np.uint8)
    scene = box_before_wall(n=3, height=5, width=12)
    one, other = (
        Sweep.of(evolve(scene, views=seen), Costs(fineness=fineness)) for seen in (views, views[::-1, :, ::-1].copy())
    )
    ranges = Ranges.of(one.phases), Ranges.of(other.phases)
    for plane in range(one.space.planes):
        left = ranges[0].difference(one, 0, plane)
        right = ranges[1].difference(other, 2, plane)
        np.testing.assert_allclose(left, right[:, ::-1], atol=0.01)
