"""How likely rays end at the answers, against the materialities of whole volumes and against plain sums."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from matbench.algorithms.agreement import ENDED, PRIOR
from matbench.algorithms.materiality.binarize import seen_rays
from matbench.algorithms.materiality.consensus import consensus
from matbench.algorithms.ray_ends import agreement, rays_end_near, seen_near
from matbench.algorithms.similarity import Matcher, Matching
from matbench.scene import Range, Scene


def random_matcher(n, height, width, least, largest, seed, **settings):
    views = np.random.default_rng(seed).integers(0, 256, (n, height, width, 3), dtype=np.uint8)
    scene = Scene("random", views, tuple(map(str, range(n))), n // 2, Range(least, largest), {}, 1.0)
    return Matcher.of(scene, Matching(views=0, **settings))


def slow(matcher, maps, answer):
    """The sum of mu V over the planes within one of each answer, point by point."""
    space, view, q = matcher.space, matcher.scene.ref, matcher.space.fineness
    out = np.zeros(answer.shape)
    for y, x in np.ndindex(answer.shape):
        through = 1.0
        for k in reversed(range(space.planes)):
            ended, reached = ENDED, PRIOR
            for j in range(space.views):
                sample = x * q - (j - view) * (space.first + k)
                if not 0 <= sample <= (space.width - 1) * q:
                    continue
                behind = k - float(maps[j, y, int(np.floor(sample / q + 0.5 - 1e-9))])
                ended += max(1 - abs(behind), 0)
                reached += min(max(behind + 2, 0), 1)
            mu = min(ended / reached, 1)
            if abs(k - answer[y, x]) <= 1:
                out[y, x] += mu * through
            through *= 1 - mu
    return np.minimum(out, 1)


@settings(deadline=None)
@given(
    n=st.integers(2, 5),
    height=st.integers(1, 3),
    width=st.integers(1, 7),
    least=st.integers(-2, 1),
    extent=st.integers(0, 3),
    fineness=st.integers(1, 3),
    seed=st.integers(0, 99),
)
def test_chances_are_plain_sums(n, height, width, least, extent, fineness, seed):
    matcher = random_matcher(n, height, width, least, least + extent, seed, fineness=fineness)
    space, rng = matcher.space, np.random.default_rng(seed)
    maps = rng.uniform(0, space.planes - 1, (n, height, width)).astype(np.float32)
    answer = maps[matcher.scene.ref]
    found = rays_end_near(matcher, maps, answer)
    np.testing.assert_allclose(found, slow(matcher, maps, answer), rtol=1e-5, atol=1e-6)
    assert (found == rays_end_near(matcher, maps, answer, 2)).all()


def test_chances_are_those_of_the_whole_volume():
    """At whole-pixel planes both ask the same pixels of the other views."""
    matcher = random_matcher(4, 6, 20, 0, 5, 3, fineness=1)
    space, view = matcher.space, matcher.scene.ref
    maps = np.random.default_rng(0).uniform(0, space.planes - 1, (4, 6, 20)).astype(np.float32)
    seen = seen_rays(consensus(space, maps), space, view)
    np.testing.assert_allclose(rays_end_near(matcher, maps, maps[view]), seen_near(seen, maps[view]), rtol=1e-5)


def test_a_surface_that_all_views_see_is_sure_and_one_that_others_see_through_is_not():
    matcher = random_matcher(5, 4, 40, 0, 6, 0, fineness=1)
    maps = np.full((5, 4, 40), 3, np.float32)
    middle = np.s_[:, 15:25]
    sure = rays_end_near(matcher, maps, maps[2])[middle]
    maps[2, :, 18:22] = 5
    doubtful = rays_end_near(matcher, maps, maps[2])[middle]
    assert sure.min() > 0.85
    assert doubtful[:, 3:7].max() < 0.35


@pytest.mark.parametrize(("answer", "wanted"), [(0.0, 0.3), (1.0, 0.6), (1.5, 0.5), (3.0, 0.7), (np.nan, 0)])
def test_known_materialities_are_summed_within_one_plane(answer, wanted):
    seen = np.array([0.1, 0.2, 0.3, 0.4], np.float32).reshape(1, 1, 4)
    assert seen_near(seen, np.full((1, 1), answer, np.float32)).item() == pytest.approx(wanted)


def test_agreement_is_a_share_of_the_views_that_vote():
    maps = np.ones((4, 2, 12), np.float32)
    maps[3, 1] = 0  # contradicts: it sees through what the others see
    found = agreement(maps, 1, 0.5)[:, 4:8]
    np.testing.assert_allclose(found, [[4 / 5] * 4, [3 / 5] * 4])
    np.testing.assert_array_equal(agreement(maps, 1, 0.5, 2)[:, 4:8], found)
