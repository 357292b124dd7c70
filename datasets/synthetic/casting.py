"""Casting rays into a world of `solids`: the compiled loops.

All rays of a row of pixels are tried on one surface after the other. Those that its window holds stand next to each
other, and numbers of a ray stand `ROOM` places apart in one array, so that several rays are computed at a time.

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
inner = njit(**(_OPTIONS | {"no_cpython_wrapper": True}))
"""The same for one that only other loops call: without an entry from Python it compiles sooner."""

BEHIND = 1e-7  # relative depth by which a point must lie behind another to be hidden by it
ROOM = 512  # most rays that are tried at a time
MARGIN = 1e-6  # slope by which a surface's window is widened: rounding must not cut off its edge


@inner
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


@inner
def inside(kind, row, a, b):  # type: ignore[no-untyped-def]
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


@inner
def _flat(kind, row, eye, rights, down, begin, count, work):  # type: ignore[no-untyped-def]
    """Put the depths at which rays meet a flat surface into `work`; infinite where they do not."""
    ox, oy, oz = eye - row[0], -row[1], -row[2]
    ahead = row[3] * ox + row[4] * oy + row[5] * oz
    r3, level, r5 = row[3], row[4] * down, row[5]
    r6, r7, r8, r9, r10, r11 = row[6], row[7], row[8], row[9], row[10], row[11]
    for i in range(count):
        right = rights[begin + i]
        slope = r3 * right + level + r5
        z = -ahead / (slope if slope != 0 else 1.0)
        z = z if z > 0 and slope != 0 else np.inf
        x, y, far = ox + z * right, oy + z * down, oz + z
        work[i] = z
        work[i + ROOM] = r6 * x + r7 * y + r8 * far
        work[i + 2 * ROOM] = r9 * x + r10 * y + r11 * far
    if kind == 0:
        for i in range(count):
            a, b = abs(work[i + ROOM]), abs(work[i + 2 * ROOM])
            work[i] = work[i] if a <= 1 and b <= 1 else np.inf
    elif kind != 6:
        for i in range(count):
            if work[i] < np.inf and not inside(kind, row, work[i + ROOM], work[i + 2 * ROOM]):
                work[i] = np.inf


@inner
def _round(kind, row, eye, rights, down, begin, count, work):  # type: ignore[no-untyped-def]
    """Put the depths at which rays meet a curved surface into `work`; infinite where they do not."""
    ox, oy, oz = eye - row[0], -row[1], -row[2]
    r3, r4, r5, r6, r7, r8 = row[3], row[4] * down, row[5], row[6], row[7] * down, row[8]
    r9, r10, r11, t = row[9], row[10] * down, row[11], row[12]
    px = row[3] * ox + row[4] * oy + row[5] * oz
    py = row[6] * ox + row[7] * oy + row[8] * oz
    pz = row[9] * ox + row[10] * oy + row[11] * oz
    closed = kind <= 11
    wide = 1 + t * pz
    whole, open_ = px * px + py * py + pz * pz - 1, px * px + py * py - wide * wide
    for i in range(count):
        right = rights[begin + i]
        dx, dy, dz = r3 * right + r4 + r5, r6 * right + r7 + r8, r9 * right + r10 + r11
        grows = t * dz
        flat = dx * dx + dy * dy
        across = px * dx + py * dy
        square = flat + dz * dz if closed else flat - grows * grows
        half = across + pz * dz if closed else across - wide * grows
        rest = whole if closed else open_
        under = half * half - square * rest
        met = under > 0 and square != 0
        root, by = np.sqrt(under if met else 1.0), square if met else 1.0
        one, two = (-half - root) / by, (-half + root) / by
        work[i] = (two if two < one else one) if met else -1.0
        work[i + ROOM] = (one if two < one else two) if met else -1.0
        work[i + 2 * ROOM] = dz
    if closed:
        other = ROOM if kind == 11 else 0
        for i in range(count):
            z = work[i + other]
            work[i] = z if z > 0 else np.inf
    else:
        for i in range(count):
            one, two, dz = work[i], work[i + ROOM], work[i + 2 * ROOM]
            a, b = pz + one * dz, pz + two * dz
            first = one > 0 and abs(a) <= 1 and 1 + t * a > 0
            second = two > 0 and abs(b) <= 1 and 1 + t * b > 0
            work[i] = one if first else (two if second else np.inf)


@inner
def hits(kind, row, eye, rights, down, begin, count, work):  # type: ignore[no-untyped-def]
    """Depths at which rays (eye, 0, 0) + Z (right, down, 1) meet a surface, infinite for those that do not.

    Rays ``begin .. begin + count - 1`` are tried, at most `ROOM`. Their depths go to the front of `work`, (3 `ROOM`,).
    """
    if kind < 10:
        _flat(kind, row, eye, rights, down, begin, count, work)
    else:
        _round(kind, row, eye, rights, down, begin, count, work)


@inner
def candidates(windows, down, found):  # type: ignore[no-untyped-def]
    """Put the surfaces that a ray of that slope down can meet into `found`, nearest first; how many they are."""
    count = 0
    for k in range(windows.shape[0]):
        if windows[k, 2] - MARGIN < down < windows[k, 3] + MARGIN:
            found[count] = k
            count += 1
    return count


@inner
def cast(kinds, rows, windows, found, met, eye, rights, down, count, work, depth, index):  # type: ignore[no-untyped-def]
    """Depth and number of the nearest surface on each ray of a row; infinite and -1 where there is none.

    Parameters
    ----------
    found, met
        The surfaces that the row can meet, nearest first, and how many they are.
    rights, count
        Slopes to the right, ascending, and how many they are.
    work
        (3 `ROOM`,) numbers on the way.
    """
    for i in range(count):
        depth[i] = np.inf
        index[i] = -1
    for j in range(met):
        k = found[j]
        least = windows[k, 4]
        begin = np.searchsorted(rights[:count], windows[k, 0] - MARGIN, side="right")
        end = np.searchsorted(rights[:count], windows[k, 1] + MARGIN)
        while begin < end:
            some = min(end - begin, ROOM)
            hits(kinds[k], rows[k], eye, rights, down, begin, some, work)
            for i in range(some):
                # a surface that begins behind what is nearest so far is not before it, whatever rounding says
                nearer = work[i] < depth[begin + i] and least <= depth[begin + i]
                depth[begin + i] = work[i] if nearer else depth[begin + i]
                index[begin + i] = k if nearer else index[begin + i]
            begin += some


@exact
def depths(kinds, rows, windows, eye, rights, downs, depth, index):  # type: ignore[no-untyped-def]
    """Depth and number of the surface on each ray: `rights` are the slopes of the columns, `downs` of the rows."""
    found, work = np.empty(kinds.size, np.int64), np.empty(3 * ROOM)
    for y in range(downs.size):
        met = candidates(windows, downs[y], found)
        cast(kinds, rows, windows, found, met, eye, rights, downs[y], rights.size, work, depth[y], index[y])


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
    found, work = np.empty(kinds.size, np.int64), np.empty(3 * ROOM)
    rights, limits, tried = np.empty(width), np.empty(width), np.empty(width, np.bool_)
    for y in range(height):
        level = -0.5 <= y + top < height - 0.5
        for x in range(width):
            rights[x] = (places[y, x] - middle) / focal
            limits[x] = depth[y, x] * (1 - BEHIND)
            out[y, x] = level and -0.5 <= places[y, x] < width - 0.5
        met = candidates(windows, downs[y], found) if level else 0
        for j in range(met):
            k = found[j]
            left, right, least = windows[k, 0] - MARGIN, windows[k, 1] + MARGIN, windows[k, 4]
            begin, end = width, 0
            for x in range(width):
                tried[x] = out[y, x] and least < limits[x] and left < rights[x] and rights[x] < right
                if tried[x]:
                    begin, end = min(begin, x), x + 1
            while begin < end:
                some = min(end - begin, ROOM)
                hits(kinds[k], rows[k], eye, rights, downs[y], begin, some, work)
                for i in range(some):
                    x = begin + i
                    out[y, x] = out[y, x] and not (tried[x] and work[i] < limits[x])
                begin += some
