"""Small random networks, for maximal flows."""

import numpy as np
from hypothesis import strategies as st

from matbench.algorithms.cuts.network import Network


@st.composite
def networks(draw, most=12):
    """Networks of up to `most` nodes; some arcs are parallel, some of capacity 0."""
    rng = np.random.default_rng(draw(st.integers(0, 9999)))
    nodes, pairs = draw(st.integers(1, most)), draw(st.integers(0, 3 * most))
    tails, heads = rng.integers(0, nodes, (2, pairs)).astype(np.int32)
    apart = tails != heads
    forth, back = rng.integers(0, draw(st.sampled_from([1, 4, 50])) + 1, (2, apart.sum())).astype(np.int32)
    excess = rng.integers(-20, 21, nodes).astype(np.int32)
    return Network.of(excess, tails[apart], heads[apart], forth, back)
