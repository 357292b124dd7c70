"""Small maps of materialities, and their visibility and energy by brute force in float64."""

import numpy as np
from hypothesis import strategies as st

from matbench.algorithms.materiality.objective import Energy
from matbench.space import DisparitySpace

SPACES = st.builds(
    lambda n, rows, width, first, extent, q: DisparitySpace(n, rows, width, first, first + extent, q),
    n=st.integers(2, 9),
    rows=st.integers(1, 3),
    width=st.integers(1, 6),
    first=st.integers(-3, 1),
    extent=st.integers(0, 4),
    q=st.integers(1, 2),
)


PAIR_SETS = st.sampled_from(["all", "consecutive", "reference"])


def ray_walk(mu, space, view):
    """(planes, columns) visibility of one row, walking from every point towards the camera (equations 2-4)."""
    seen = np.zeros(mu.shape)
    for k, c in np.ndindex(mu.shape):
        sample = c - space.start(view, k)
        if 0 <= sample < space.samples:
            seen[k, c] = np.prod([1 - mu[m, space.start(view, m) + sample] for m in range(k + 1, space.planes)])
    return seen


def data_energy(mu, rho, space, which):
    """Equation 6 of one row."""
    seen = [ray_walk(mu, space, view) for view in range(space.views)]
    return sum(((rho[p] - mu * seen[i] * seen[j]) ** 2).sum() for p, (i, j) in enumerate(which))


def random_row(space, which, seed, opaque=True):
    rng = np.random.default_rng(seed)
    mu = rng.random((space.planes, space.columns))
    if opaque:
        mu[rng.random(mu.shape) < 0.2] = 1
    rho = rng.random((len(which), space.planes, space.columns))
    for p, (i, j) in enumerate(which):
        for k in range(space.planes):
            inside = np.zeros((2, space.columns), bool)
            inside[0, space.frustum(i, k)] = inside[1, space.frustum(j, k)] = True
            rho[p, k, ~inside.all(axis=0)] = 0
    return mu, rho


def plain_energy(space, which, rho, scale=1.0):
    """E_data alone."""
    none = np.zeros((0, 0, 0), np.uint8)
    return Energy(space, which, rho, 1.0, 0.0, True, 0.0, 0.0, (none, none), scale)


def pass_over(energy, mu, threads=1):
    """E and dE/dmu at mu."""
    new, slopes = np.empty_like(mu), np.empty_like(mu)
    found = energy.step(mu, np.full_like(mu, np.nan), 0.0, 0.01, new, slopes, threads)
    np.testing.assert_allclose(new, np.clip(mu - 0.01 * slopes, 0, 1), atol=1e-6)
    return found["data"], slopes


def random_bytes(space, which, rng):
    """(rows, pairs, planes, columns) similarities; which points both views of a pair see; which each view sees."""
    both = np.zeros((len(which), space.planes, space.columns), bool)
    sees = np.zeros((space.views, space.planes, space.columns), bool)
    for k in range(space.planes):
        for view in range(space.views):
            sees[view, k, space.frustum(view, k)] = True
    for p, (i, j) in enumerate(which):
        both[p] = sees[i] & sees[j]
    return rng.integers(0, 256, (space.rows, *both.shape), dtype=np.uint8) * both, both, sees
