"""Materiality without visibility against plain sums over the other views' rays."""

import numpy as np
import pytest

from matbench.algorithms.agreement import agreement
from matbench.algorithms.fusion import Fusion
from matbench.algorithms.similarity import Matcher, Matching
from matbench.scene import Range, Scene


def random_matcher(n, fineness, seed=0, height=3, width=7, least=-1, largest=2):
    views = np.random.default_rng(seed).integers(0, 256, (n, height, width, 3), dtype=np.uint8)
    scene = Scene("random", views, tuple(map(str, range(n))), n // 2, Range(least, largest), {}, 1.0)
    return Matcher.of(scene, Matching(views=0, fineness=fineness))


@pytest.mark.parametrize("fineness", [1, 2, 3])
@pytest.mark.parametrize("n", [2, 3, 6])
def test_mu_is_the_share_of_the_rays_through_a_point_that_end_there(n, fineness):
    for view in (0, n - 1):
        matcher = random_matcher(n, fineness).with_reference(view)
        space = matcher.space
        rng = np.random.default_rng(view)
        maps = (rng.random((n, space.rows, space.width)) * (space.planes - 1)).astype(np.float32)
        expected = np.empty((space.rows, space.planes, space.width))
        for y, k, x in np.ndindex(expected.shape):
            ended, passing = 0.05, 0.5
            for j in range(n):
                sample = x * fineness - (j - view) * (space.first + k)
                if j != view and 0 <= sample < space.samples:
                    whole, rest = divmod(sample, fineness)
                    passing += 1
                    ended += max(0, 1 - abs(k - maps[j, y, whole + (2 * rest > fineness)]))
            expected[y, k, x] = ended / passing
        one, two = (agreement(matcher, maps, threads) for threads in (1, 2))
        np.testing.assert_allclose(one, expected, rtol=1e-6)
        np.testing.assert_array_equal(two, one)


def test_it_is_mu_where_nothing_hides_anything():
    matcher = random_matcher(4, 1)
    space = matcher.space
    farthest = np.zeros((4, space.rows, space.width), np.float32)
    np.testing.assert_array_equal(agreement(matcher, farthest), Fusion().seen_cost(matcher, farthest)[1])
