"""Near surfaces end where less than half of a pixel is theirs."""

import numpy as np
import pytest

from matbench.algorithms.outlines import CONTRAST, JUMP, SAME, outlined

NEAR, FAR = 8.0, 2.0  # pixels of disparity


def slow(found, image):
    """The twin: every pixel with all four that are asked, in floating point."""
    height, width = found.shape
    out = found.copy()
    for y in range(height):
        for x in range(2, width - 2):
            for side in (-1, 1):
                inside, here, beside, beyond = (found[y, x + step * side] for step in (-1, 0, 1, 2))
                if here - beside <= JUMP or abs(here - inside) >= SAME or abs(beside - beyond) >= SAME:
                    continue
                far = image[y, x + 2 * side].astype(float)
                apart, own = image[y, x - side] - far, image[y, x] - far
                if np.sqrt(apart @ apart) > CONTRAST and own @ apart / (apart @ apart) < 0.5:
                    out[y, x] = min(out[y, x], beside)
    return out


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_kernel_does_what_its_twin_does(seed):
    random = np.random.default_rng(seed)
    steps = random.choice([0, 3, 6], (12, 40))
    found = (np.repeat(steps, 3, axis=1) + random.uniform(0, 1, (12, 120))).astype(np.float32)
    image = np.repeat(random.integers(0, 256, (12, 40, 3)), 3, axis=1) + random.integers(-90, 90, (12, 120, 3))
    image = image.clip(0, 255).astype(np.uint8)
    expected = slow(found, image)
    assert (expected != found).sum() > 20
    np.testing.assert_array_equal(outlined(found, image), expected)


def edge(share):
    """A near bar of pixels 3 to 8 of a row; the outermost pixels that are given to it are its own by that share."""
    found = np.full((1, 12), FAR, np.float32)
    found[:, 3:9] = NEAR
    near, far = np.array([200, 60, 40]), np.array([40, 90, 120])
    image = np.where(found[..., None] == NEAR, near, far)
    image[:, [3, 8]] = np.rint(share * near + (1 - share) * far)
    return found, image.astype(np.uint8)


@pytest.mark.parametrize(("share", "first"), [(0.9, 3), (0.6, 3), (0.4, 4), (0.0, 4)])
def test_a_pixel_belongs_to_the_surface_that_has_the_larger_part_of_it(share, first):
    out = outlined(*edge(share))
    assert (np.flatnonzero(out == NEAR) == np.arange(first, 12 - first)).all()
    assert (np.delete(out, np.flatnonzero(out == NEAR)) == FAR).all()


def test_where_colours_do_not_tell_nothing_changes():
    found, image = edge(0.2)
    grey = np.clip(image, 100, 110)
    np.testing.assert_array_equal(outlined(found, grey), found)


def test_what_is_one_pixel_wide_stays():
    found, image = edge(0.2)
    found[:, 4:9] = FAR
    np.testing.assert_array_equal(outlined(found, image), found)


def test_a_slope_is_no_outline():
    slope = np.arange(12, dtype=np.float32)[None] * np.float32(SAME)
    np.testing.assert_array_equal(outlined(slope, edge(0.2)[1]), slope)


@pytest.mark.parametrize("shape", [(1, 1), (3, 2), (2, 4)])
def test_maps_smaller_than_what_is_asked(shape):
    found = np.ones(shape, np.float32)
    np.testing.assert_array_equal(outlined(found, np.zeros((*shape, 3), np.uint8)), found)
