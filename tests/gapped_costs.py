"""Random costs, some of them unknown, and an image: what semi-global matching starts from."""

from typing import Any

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray


@st.composite
def costs_and_image(draw: st.DrawFn, rows: int) -> tuple[NDArray[np.float32], NDArray[Any]]:
    """(H, planes, W) costs in [0, 1), NaN where they are unknown, and (H, W, 3) uint8; H is at most `rows`."""
    shape = tuple(draw(st.integers(1, top)) for top in (rows, 7, 9))
    rng = np.random.default_rng(draw(st.integers(0, 999)))
    cost = rng.random(shape, np.float32)
    cost[rng.random(shape) < draw(st.sampled_from([0, 0.2, 0.9]))] = np.nan
    return cost, rng.integers(0, 60, (*shape[::2], 3), dtype=np.uint8)
