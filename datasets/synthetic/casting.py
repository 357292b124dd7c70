"""Casting rays into a world of `solids`: the compiled loops.

Only sums, products, quotients and square roots of float64 are computed, in the order in which they are written: these
are rounded in the same way by every processor. Therefore a world is the same on every machine.
"""

from typing import Any

import numpy as np
from numba import njit

from matbench.plans import kernel_cache  # noqa: F401 -- kernels work without a cache, too

_OPTIONS: dict[str, Any] = {
    "nogil": True,
    "cache": True,
    "error_model": "numpy",
    "fastmath": False,
    "no_cfunc_wrapper": True,
}
exact = njit(**_OPTIONS)
"""How a loop is compiled whose last bit matters: nothing is reordered, and every product is rounded on its own."""

BEHIND = 1e-7  # relative depth by which a point must lie behind another to be hidden by it
MARGIN = 1e-6  # slope by which a surface's window is widened: rounding must not cut off its edge


@exact
def _spoke(row, a, b):  # type: ignore[no-untyped-def]
    """Radius of a blob in the direction (a, b), whose angle is told without trigonometry."""
    size = abs(a) + abs(b)
    if size == 0:
        return row[12]
    turn = a / size if b >= 0 else 2 - a / size  # 1 .. -1 above, 1 .. 3 below
    place = (turn + 1) * 4  # 0 .. 16
    first = int(np.floor(place))
    part = place - first
    return row[12 + first % 16] * (1 - part) + row[12 + (first + 1) % 16] * part


@exact
def _inside(kind, row, a, b):  # type: ignore[no-untyped-def]
    """Does a flat surface's outline hold the place (a, b)?"""
    if kind == 6:
        return True
    if kind == 1:
        return a * a + b * b <= 1
    if abs(a) > 1 or abs(b) > 1:
        return False
    if kind == 0:
        return True
    if kind == 2:
        return abs(b) <= 1 - a * a
    if kind == 3:
        radius = _spoke(row, a, b)
        return a * a + b * b <= radius * radius
    if kind == 4:
        across, down = (a + 1) / 2 * row[12], (b + 1) / 2 * row[13]
        return across - np.floor(across) < row[14] or down - np.floor(down) < row[15]
    return row[12] <= a * a + b * b <= 1


@exact
def hit(kind, row, eye, right, down):  # type: ignore[no-untyped-def]
    """Depth at which the ray (eye, 0, 0) + Z (right, down, 1) meets a surface; infinite if it does not."""
    ox, oy, oz = eye - row[0], -row[1], -row[2]
    if kind < 10:
        slope = row[3] * right + row[4] * down + row[5]
        if slope == 0:
            return np.inf
        z = -(row[3] * ox + row[4] * oy + row[5] * oz) / slope
        if not z > 0:
            return np.inf
        x, y, far = ox + z * right, oy + z * down, oz + z
        a = row[6] * x + row[7] * y + row[8] * far
        b = row[9] * x + row[10] * y + row[11] * far
        return z if _inside(kind, row, a, b) else np.inf
    px, dx = row[3] * ox + row[4] * oy + row[5] * oz, row[3] * right + row[4] * down + row[5]
    py, dy = row[6] * ox + row[7] * oy + row[8] * oz, row[6] * right + row[7] * down + row[8]
    pz, dz = row[9] * ox + row[10] * oy + row[11] * oz, row[9] * right + row[10] * down + row[11]
    if kind <= 11:
        square, half, rest = dx * dx + dy * dy + dz * dz, px * dx + py * dy + pz * dz, px * px + py * py + pz * pz - 1
    else:
        t = row[12]
        wide, grows = 1 + t * pz, t * dz
        square, half = dx * dx + dy * dy - grows * grows, px * dx + py * dy - wide * grows
        rest = px * px + py * py - wide * wide
    under = half * half - square * rest
    if under <= 0 or square == 0:
        return np.inf
    root = np.sqrt(under)
    one, two = (-half - root) / square, (-half + root) / square
    if two < one:
        one, two = two, one
    if kind == 10:
        return one if one > 0 else np.inf
    if kind == 11:
        return two if two > 0 else np.inf
    for z in (one, two):
        along = pz + z * dz
        if z > 0 and abs(along) <= 1 and 1 + row[12] * along > 0:
            return z
    return np.inf


@exact
def candidates(windows, down, found):  # type: ignore[no-untyped-def]
    """Put the surfaces that a ray of that slope down can meet into `found`, nearest first; how many they are."""
    count = 0
    for k in range(windows.shape[0]):
        if windows[k, 2] - MARGIN < down < windows[k, 3] + MARGIN:
            found[count] = k
            count += 1
    return count


@exact
def first(kinds, rows, windows, found, count, eye, right, down):  # type: ignore[no-untyped-def]
    """Depth of the nearest surface on a ray, and its number; infinite and -1 if there is none."""
    nearest, number = np.inf, -1
    for i in range(count):
        k = found[i]
        if windows[k, 4] > nearest:
            break
        if windows[k, 0] - MARGIN < right < windows[k, 1] + MARGIN:
            z = hit(kinds[k], rows[k], eye, right, down)
            if z < nearest:
                nearest, number = z, k
    return nearest, number


@exact
def depths(kinds, rows, windows, eye, rights, downs, depth, index):  # type: ignore[no-untyped-def]
    """Depth and number of the surface on each ray: `rights` are the slopes of the columns, `downs` of the rows."""
    found = np.empty(kinds.size, np.int64)
    for y in range(downs.size):
        count = candidates(windows, downs[y], found)
        for x in range(rights.size):
            z, k = first(kinds, rows, windows, found, count, eye, rights[x], downs[y])
            depth[y, x] = z
            index[y, x] = k


@exact
def seen(kinds, rows, windows, eye, middle, focal, downs, top, places, depth, out):  # type: ignore[no-untyped-def]
    """Does another view see the points of this one?

    Parameters
    ----------
    middle, focal
        Column of the other view's optical axis, and its focal length, px.
    downs
        Slope down of the rays through each row of points, the same in both views.
    top
        By how much lower the points lie in the other picture, px.
    places
        (H, W) columns of the points in the other view's picture.
    depth
        (H, W) their depth.
    """
    height, width = depth.shape
    found = np.empty(kinds.size, np.int64)
    for y in range(height):
        row = y + top
        level = -0.5 <= row < height - 0.5
        count = candidates(windows, downs[y], found)
        for x in range(width):
            place = places[y, x]
            out[y, x] = False
            if level and -0.5 <= place < width - 0.5:
                right = (place - middle) / focal
                limit = depth[y, x] * (1 - BEHIND)
                clear = True
                for i in range(count):
                    k = found[i]
                    if windows[k, 4] >= limit:
                        break
                    framed = windows[k, 0] - MARGIN < right < windows[k, 1] + MARGIN
                    if framed and hit(kinds[k], rows[k], eye, right, downs[y]) < limit:
                        clear = False
                        break
                out[y, x] = clear
