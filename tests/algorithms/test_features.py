"""What is compared besides colour, against a walk over the pixels around."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from neighbours import like_middle

from matbench.algorithms.features import same_surface


@settings(max_examples=25, deadline=None)
@given(
    shape=st.tuples(st.integers(1, 2), st.sampled_from([1, 3]), st.integers(1, 5), st.integers(1, 12)),
    fineness=st.integers(1, 3),
    most=st.sampled_from([1.0, 2.0, 4.0]),
    seed=st.integers(0, 99),
)
def test_same_surface_is_what_is_near_or_of_a_colour(shape, fineness, most, seed):
    rows = np.random.default_rng(seed).integers(-3, 4, shape).astype(np.float32)
    bits = same_surface(rows, fineness, most)
    assert bits.shape == (shape[0], 6, *shape[2:])
    for view, y, x in np.ndindex(shape[0], *shape[2:]):
        like = np.delete(like_middle(rows[view], y, x, fineness, most).ravel(), 24)
        assert "".join(f"{word:08b}" for word in bits[view, :, y, x]) == "".join(map(str, like.astype(int)))
