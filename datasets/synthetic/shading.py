"""Pictures of a world of `solids`: the compiled loop that gives each ray its colour."""

import numpy as np

from matbench.datasets.synthetic.casting import MARGIN, candidates, exact, first, hit

RELIEF = 0.35
"""How far the pattern bends the normal of a glossy surface, for a deviation of its colours from grey."""


@exact
def _lookup(tile, starts, across, down, footprint, colour):  # type: ignore[no-untyped-def]
    """Colour of a tile (period 1) at a place, averaged over about `footprint` texels; linear between texels."""
    level = 0
    while footprint > 1.4 and level < starts.size - 2:
        footprint *= 0.5
        level += 1
    start, size = starts[level], 512 >> level
    x, y = across * size - 0.5, down * size - 0.5
    left, top = np.floor(x), np.floor(y)
    u, v = x - left, y - top
    i, j = int(left) & (size - 1), int(top) & (size - 1)
    k, m = (i + 1) & (size - 1), (j + 1) & (size - 1)
    a, b, e, f = start + j * size + i, start + j * size + k, start + m * size + i, start + m * size + k
    one, two, three, four = (1 - u) * (1 - v) / 40, u * (1 - v) / 40, (1 - u) * v / 40, u * v / 40
    for c in range(3):
        colour[c] = tile[a, c] * one + tile[b, c] * two + tile[e, c] * three + tile[f, c] * four


@exact
def _colour(kind, row, skin, tiles, starts, eye, right, down, z, spacing, light, colour, grain):  # type: ignore[no-untyped-def]
    """Colour of the point at depth z on a ray.

    Parameters
    ----------
    spacing
        Between rays, as a difference of slopes.
    light
        Unit vector towards the light, the share of light from everywhere, and the highlight in grey levels.
    """
    wx, wy, wz = eye + z * right, z * down, z
    ox, oy, oz = wx - row[0], wy - row[1], wz - row[2]
    px = row[3] * ox + row[4] * oy + row[5] * oz
    py = row[6] * ox + row[7] * oy + row[8] * oz
    pz = row[9] * ox + row[10] * oy + row[11] * oz
    if kind < 10:
        nx, ny, nz = row[3], row[4], row[5]
        a = py / np.sqrt(row[6] * row[6] + row[7] * row[7] + row[8] * row[8])
        b = pz / np.sqrt(row[9] * row[9] + row[10] * row[10] + row[11] * row[11])
    else:
        end = pz if kind <= 11 else -row[12] * (1 + row[12] * pz)
        nx = px * row[3] + py * row[6] + end * row[9]
        ny = px * row[4] + py * row[7] + end * row[10]
        nz = px * row[5] + py * row[8] + end * row[11]
        a, b = ox + 0.4 * oz, oy + 0.4 * oz
    size = np.sqrt(nx * nx + ny * ny + nz * nz)
    far = np.sqrt((wx - eye) * (wx - eye) + wy * wy + wz * wz)
    facing = (nx * (wx - eye) + ny * wy + nz * wz) / (size * far)
    if facing > 0:
        nx, ny, nz = -nx, -ny, -nz
    facing = max(abs(facing), 0.1)
    nx, ny, nz = nx / size, ny / size, nz / size
    u = skin[1] * a + skin[2] * b + skin[3]
    v = skin[1] * b - skin[2] * a + skin[4]
    # the footprint of a ray is longer than wide by 1 / facing: a square of the same area
    texels = 512.0 * np.sqrt(skin[1] * skin[1] + skin[2] * skin[2]) * z * spacing / np.sqrt(facing)
    _lookup(tiles[int(skin[0])], starts, u, v, texels, colour)
    grey = (colour[0] + colour[1] + colour[2]) / 3
    bend, lean = colour[0] - grey, colour[2] - grey
    for c in range(3):
        colour[c] = skin[8] * (grey + skin[12] * (colour[c] - grey))
    if skin[10] > 0:
        _lookup(tiles[0], starts, skin[11] * u, skin[11] * v, skin[11] * texels, grain)
        for c in range(3):
            colour[c] += skin[10] * grain[c]
    lit = light[3] + (1 - light[3]) * max(0.0, nx * light[0] + ny * light[1] + nz * light[2])
    shine = 0.0
    if light[4] * skin[9] > 0:
        hx, hy, hz = light[0] - (wx - eye) / far, light[1] - wy / far, light[2] - wz / far
        nx, ny = nx + RELIEF * bend, ny + RELIEF * lean
        cosine = (nx * hx + ny * hy + nz * hz) / np.sqrt((hx * hx + hy * hy + hz * hz) * (nx * nx + ny * ny + nz * nz))
        cosine = max(cosine, 0.0)
        for _ in range(int(skin[13])):
            cosine *= cosine
        shine = light[4] * skin[9] * cosine
    for c in range(3):
        colour[c] = max((skin[5 + c] + colour[c]) * lit, 0.0) + shine


@exact
def _around(windows, above, below, found):  # type: ignore[no-untyped-def]
    """Put the surfaces that rays between two slopes down can meet into `found`; how many they are."""
    count = 0
    for k in range(windows.shape[0]):
        if windows[k, 2] - MARGIN < below and windows[k, 3] + MARGIN > above:
            found[count] = k
            count += 1
    return count


@exact
def _alone(windows, found, count, left, right):  # type: ignore[no-untyped-def]
    """Can rays between two slopes to the right meet one of these surfaces at most?"""
    met = 0
    for i in range(count):
        k = found[i]
        met += windows[k, 0] - MARGIN < right and windows[k, 1] + MARGIN > left
    return met < 2


@exact
def picture(kinds, rows, windows, skins, tiles, starts, eye, middle, focal, top, light, index, out):  # type: ignore[no-untyped-def]
    """Grey levels of a picture, each pixel the mean of 4 x 4 rays where surfaces meet, else of 2 x 2, or of 2.

    Parameters
    ----------
    middle, top, focal
        Column and row of the optical axis, and the focal length, px.
    index
        (H, W) the surface at every pixel's centre.
    out
        (H, W, 3) float32.
    """
    height, width = index.shape
    found = np.empty((6, kinds.size), np.int64)
    around = np.empty(kinds.size, np.int64)
    counts = np.empty(6, np.int64)
    downs = np.empty(6)
    colour, grain, total = np.empty(3), np.empty(3), np.empty(3)
    for y in range(height):
        for s in range(6):
            shift = (s - 0.5) * 0.5 if s < 2 else (s - 3.5) * 0.25
            downs[s] = (y + shift - top) / focal
            counts[s] = candidates(windows, downs[s], found[s])
        near = _around(windows, (y - 0.5 - top) / focal, (y + 0.5 - top) / focal, around)
        for x in range(width):
            own = index[y, x]
            alone = _alone(windows, around, near, (x - 0.5 - middle) / focal, (x + 0.5 - middle) / focal)
            alike = True
            if x > 0:
                alike = alike and index[y, x - 1] == own
            if x < width - 1:
                alike = alike and index[y, x + 1] == own
            if y > 0:
                alike = alike and index[y - 1, x] == own
            if y < height - 1:
                alike = alike and index[y + 1, x] == own
            if alone:  # two rays do, on a diagonal
                side = 1
            elif alike:
                side = 2
            else:
                side = 4
            while True:
                for c in range(3):
                    total[c] = 0.0
                same, begin, count = True, (2 if side == 4 else 0), max(side, 2)
                for s in range(begin, begin + count):
                    for t in range(side):
                        shift = (t - 1.5) * 0.25 if side == 4 else (t + s * (2 - side) - 0.5) * 0.5
                        right = (x + shift - middle) / focal
                        if alone:
                            z, k = hit(kinds[own], rows[own], eye, right, downs[s]), own
                        else:
                            z, k = first(kinds, rows, windows, found[s], counts[s], eye, right, downs[s])
                        same = same and k == own
                        if k >= 0 and z < np.inf:
                            _colour(
                                kinds[k],
                                rows[k],
                                skins[k],
                                tiles,
                                starts,
                                eye,
                                right,
                                downs[s],
                                z,
                                0.5 / focal,
                                light,
                                colour,
                                grain,
                            )
                            for c in range(3):
                                total[c] += colour[c]
                if same or side == 4:
                    break
                side = 4
            for c in range(3):
                out[y, x, c] = total[c] / (side * count)
