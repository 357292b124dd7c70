"""Visibility, energy and exact gradient of one epipolar plane (SPEC 1-2), in float32 or float64.

Arrays of a row: `mu` (planes, columns) over the target points; `seen` (views, planes, samples)
and the workspaces (views, samples) in the columns of each view, so that a frustum (equation 4) is
the whole row and nothing branches. View i starts in plane k at column i (first + k) - origin.
`one` is 1 in the type of the arrays: it keeps bare literals from widening the arithmetic.
"""

from matbench.algorithms.kernels import helper, kernel


@helper
def _dim(through, mu, one, beyond):  # type: ignore[no-untyped-def]
    """What is seen one plane further: V (1 - mu)."""
    for x in range(through.size):
        beyond[x] = through[x] * (one - mu[x])


@kernel
def see_row(mu, first, origin, one, seen):  # type: ignore[no-untyped-def]
    """V_i(s) = product of (1 - mu) over the nearer points on the ray (equation 3), near to far."""
    views, planes, samples = seen.shape
    for i in range(views):
        seen[i, planes - 1] = one
        for k in range(planes - 1, 0, -1):
            start = i * (first + k) - origin
            _dim(seen[i, k], mu[k, start : start + samples], one, seen[i, k - 1])


@helper
def _match(mu, vi, vj, rho, scale, slope, pull_i, pull_j):  # type: ignore[no-untyped-def]
    """Residuals r = mu V_i V_j - rho of one pair in one plane: adds 2 r V_i V_j to `slope`.

    `pull_i` gains dE/dV_i = 2 r mu V_j and `pull_j` alike. Returns the sum of r^2.
    """
    energy = scale - scale
    for x in range(mu.size):
        both = vi[x] * vj[x]
        r = mu[x] * both - scale * rho[x]
        energy += r * r
        twice = r + r
        slope[x] += twice * both
        pull = twice * mu[x]
        pull_i[x] += pull * vj[x]
        pull_j[x] += pull * vi[x]
    return energy


@helper
def _shade(mu, through, pull, one, slope, behind):  # type: ignore[no-untyped-def]
    """What a point takes from all behind it on a ray: slope -= V A, then A = g + (1 - mu) A; g = 0 again."""
    for x in range(mu.size):
        slope[x] -= through[x] * behind[x]
        behind[x] = pull[x] + (one - mu[x]) * behind[x]
        pull[x] = one - one


@kernel
def data_row(mu, seen, rho, scale, pairs, first, origin, one, slope, behind, pull):  # type: ignore[no-untyped-def]
    """E_data of a row (equation 6) and its exact gradient (SPEC 2), far to near.

    Parameters
    ----------
    mu
        (planes, columns) materialities.
    seen
        (views, planes, samples) their visibilities from `see_row`.
    rho
        (pairs, planes, columns) similarities in units of `scale`; 0 outside either frustum.
    pairs
        (pairs, 2) views of each pair.
    slope
        (planes, columns), overwritten: dE_data/dmu.
    behind, pull
        (views, samples) workspace: A_i of SPEC 2, and g_i.

    Returns
    -------
    E_data of the row.
    """
    views, planes, samples = seen.shape
    energy = 0.0
    slope[:] = 0
    behind[:] = 0
    pull[:] = 0
    for k in range(planes):
        for p in range(pairs.shape[0]):
            i, j = pairs[p, 0], pairs[p, 1]
            start_i, start_j = i * (first + k) - origin, j * (first + k) - origin
            low, high = max(start_i, start_j), min(start_i, start_j) + samples
            if low < high:
                energy += _match(
                    mu[k, low:high],
                    seen[i, k, low - start_i : high - start_i],
                    seen[j, k, low - start_j : high - start_j],
                    rho[p, k, low:high],
                    scale,
                    slope[k, low:high],
                    pull[i, low - start_i : high - start_i],
                    pull[j, low - start_j : high - start_j],
                )
        for i in range(views):
            start = i * (first + k) - origin
            _shade(
                mu[k, start : start + samples], seen[i, k], pull[i], one, slope[k, start : start + samples], behind[i]
            )
    return energy


@helper
def _tie(here, there, weight, strength, slope):  # type: ignore[no-untyped-def]
    """strength w (here - there)^2: adds its derivative by `here` to `slope`, returns its sum."""
    energy = strength - strength
    for x in range(here.size):
        gap = here[x] - there[x]
        pull = strength * weight[x] * gap
        energy += pull * gap
        slope[x] += pull + pull
    return energy


@helper
def _tie_along(mu, weight, strength, slope):  # type: ignore[no-untyped-def]
    """The same between neighbours of a plane's row: weight[x] ties x and x + 1."""
    energy = strength - strength
    n = mu.size - 1
    for x in range(n):
        gap = mu[x + 1] - mu[x]
        energy += strength * weight[x] * gap * gap
    twice = strength + strength
    slope[0] -= twice * weight[0] * (mu[1] - mu[0])
    for x in range(1, n):
        slope[x] += twice * (weight[x - 1] * (mu[x] - mu[x - 1]) - weight[x] * (mu[x + 1] - mu[x]))
    slope[n] += twice * weight[n - 1] * (mu[n] - mu[n - 1])
    return energy


@kernel
def smooth_row(mu, above, below, w_above, w_below, w_along, across, along, slope):  # type: ignore[no-untyped-def]
    """Adjacent-plane part of E_smooth (SPEC 4): what ties a row to the next one and along itself.

    Parameters
    ----------
    mu, above, below
        (planes, columns) materialities of row y, y - 1 and y + 1; at the image's border, those
        of row y itself.
    w_above, w_below, w_along
        (planes, columns) edge weights in 255ths between y - 1 and y, y and y + 1, x and x + 1.
    across, along
        lambda_y / 255 and lambda_x / 255.
    slope
        (planes, columns): gains the derivative.

    Returns
    -------
    lambda_y sum w (mu(y + 1) - mu(y))^2 + lambda_x sum w (mu(x + 1) - mu(x))^2 of the row.
    """
    energy = 0.0
    for k in range(mu.shape[0]):
        _tie(mu[k], above[k], w_above[k], across, slope[k])
        energy += _tie(mu[k], below[k], w_below[k], across, slope[k])
        if mu.shape[1] > 1:
            energy += _tie_along(mu[k], w_along[k], along, slope[k])
    return energy


@kernel
def total_row(mu):  # type: ignore[no-untyped-def]
    """Sum of the materialities of a row."""
    energy = 0.0
    for k in range(mu.shape[0]):
        part = mu[k, 0] - mu[k, 0]
        row = mu[k]
        for x in range(row.size):
            part += row[x]
        energy += part
    return energy
