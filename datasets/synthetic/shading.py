"""Pictures of a world of `solids`: the compiled loops that give rays their colours.

A row of a picture is made at a time: all its rays are cast, then shaded surface by surface.
"""

import numpy as np

from matbench.datasets.synthetic.casting import MARGIN, candidates, cast, exact, inner
from matbench.datasets.synthetic.materials import LEVELS

RELIEF = 0.35
"""How far the pattern bends the normal of a glossy surface, for a deviation of its colours from grey."""

BATCH, NUMBERS = 256, 23
"""Rays that are shaded at a time, and how many numbers each of them has. These stand `BATCH` apart in one array."""


@inner
def _meet(kind, row, skin, eye, spacing, count, work):  # type: ignore[no-untyped-def]
    """Where rays meet a surface, and how it is lit there.

    Takes slopes to the right and down and depths, the first three numbers of each ray in `work`; puts from the fourth
    on: place in the pattern (two), texels that a ray covers there, normal (three), distance.
    """
    x0, y0, z0 = row[0], row[1], row[2]
    r3, r4, r5, r6, r7, r8, r9, r10, r11, taper = (
        row[3],
        row[4],
        row[5],
        row[6],
        row[7],
        row[8],
        row[9],
        row[10],
        row[11],
        row[12],
    )
    cosine, sine, left, top = skin[1], skin[2], skin[3], skin[4]
    is_flat, is_closed = kind < 10, kind <= 11
    wide, tall = np.sqrt(r6 * r6 + r7 * r7 + r8 * r8), np.sqrt(r9 * r9 + r10 * r10 + r11 * r11)
    fine = 512.0 * np.sqrt(cosine * cosine + sine * sine)
    for i in range(count):
        right, down, z = work[i], work[i + BATCH], work[i + 2 * BATCH]
        wx, wy = eye + z * right, z * down
        ox, oy, oz = wx - x0, wy - y0, z - z0
        px = r3 * ox + r4 * oy + r5 * oz
        py = r6 * ox + r7 * oy + r8 * oz
        pz = r9 * ox + r10 * oy + r11 * oz
        end = pz if is_closed else -taper * (1 + taper * pz)
        nx = r3 if is_flat else px * r3 + py * r6 + end * r9
        ny = r4 if is_flat else px * r4 + py * r7 + end * r10
        nz = r5 if is_flat else px * r5 + py * r8 + end * r11
        a = py / wide if is_flat else ox + 0.4 * oz
        b = pz / tall if is_flat else oy + 0.4 * oz
        away = wx - eye
        size = np.sqrt(nx * nx + ny * ny + nz * nz)
        far = np.sqrt(away * away + wy * wy + z * z)
        facing = (nx * away + ny * wy + nz * z) / (size * far)
        nx, ny, nz = (-nx, -ny, -nz) if facing > 0 else (nx, ny, nz)
        facing = max(abs(facing), 0.1)
        work[i + 3 * BATCH] = cosine * a + sine * b + left
        work[i + 4 * BATCH] = cosine * b - sine * a + top
        # the footprint of a ray is longer than wide by 1 / facing: a square of the same area
        work[i + 5 * BATCH] = fine * z * spacing / np.sqrt(facing)
        work[i + 6 * BATCH] = nx / size
        work[i + 7 * BATCH] = ny / size
        work[i + 8 * BATCH] = nz / size
        work[i + 9 * BATCH] = far


@inner
def _lookup(tile, starts, scale, count, work, colours):  # type: ignore[no-untyped-def]
    """Colours of a tile (period 1) where rays meet it, averaged over what they cover; linear between texels.

    They become the first three numbers of each ray in `colours`, a part of `work`.
    """
    for i in range(count):
        footprint, size, level = scale * work[i + 5 * BATCH], 512.0, 0.0
        for _ in range(LEVELS - 1):
            is_wide = footprint > 1.4
            footprint = footprint * 0.5 if is_wide else footprint
            size = size * 0.5 if is_wide else size
            level = level + 1 if is_wide else level
        x, y = scale * work[i + 3 * BATCH] * size - 0.5, scale * work[i + 4 * BATCH] * size - 0.5
        left, top = np.floor(x), np.floor(y)
        u, v = x - left, y - top
        work[i + 16 * BATCH] = (1 - u) * (1 - v) / 40
        work[i + 17 * BATCH] = u * (1 - v) / 40
        work[i + 18 * BATCH] = (1 - u) * v / 40
        work[i + 19 * BATCH] = u * v / 40
        work[i + 20 * BATCH] = left
        work[i + 21 * BATCH] = top
        work[i + 22 * BATCH] = level
    for i in range(count):
        level = int(work[i + 22 * BATCH])
        start, size = starts[level], 512 >> level
        i0, j0 = int(work[i + 20 * BATCH]) & (size - 1), int(work[i + 21 * BATCH]) & (size - 1)
        above, below = start + j0 * size, start + ((j0 + 1) & (size - 1)) * size
        i1 = (i0 + 1) & (size - 1)
        one, two = work[i + 16 * BATCH], work[i + 17 * BATCH]
        three, four = work[i + 18 * BATCH], work[i + 19 * BATCH]
        for c in range(3):
            upper = tile[above + i0, c] * one + tile[above + i1, c] * two
            colours[i + c * BATCH] = upper + tile[below + i0, c] * three + tile[below + i1, c] * four


@inner
def _shine(skin, eye, light, count, work):  # type: ignore[no-untyped-def]
    """Put the highlights of rays in the place of the distances."""
    gloss, polish = light[4] * skin[9], int(skin[13])
    for i in range(count):
        right, down, z, far = work[i], work[i + BATCH], work[i + 2 * BATCH], work[i + 9 * BATCH]
        red, green, blue = work[i + 10 * BATCH], work[i + 11 * BATCH], work[i + 12 * BATCH]
        grey = (red + green + blue) / 3
        away, wy = eye + z * right - eye, z * down
        hx, hy, hz = light[0] - away / far, light[1] - wy / far, light[2] - z / far
        nx, ny = work[i + 6 * BATCH] + RELIEF * (red - grey), work[i + 7 * BATCH] + RELIEF * (blue - grey)
        nz = work[i + 8 * BATCH]
        cosine = (nx * hx + ny * hy + nz * hz) / np.sqrt((hx * hx + hy * hy + hz * hz) * (nx * nx + ny * ny + nz * nz))
        work[i + 9 * BATCH] = max(cosine, 0.0)
    for _ in range(polish):
        for i in range(count):
            work[i + 9 * BATCH] *= work[i + 9 * BATCH]
    for i in range(count):
        work[i + 9 * BATCH] = gloss * work[i + 9 * BATCH]


@inner
def _shade(kind, row, skin, tiles, starts, eye, spacing, light, count, work):  # type: ignore[no-untyped-def]
    """Colours of rays at a surface: numbers 10 to 12 of `work` without the highlight, 13 to 15 with it."""
    _meet(kind, row, skin, eye, spacing, count, work)
    _lookup(tiles[int(skin[0])], starts, 1.0, count, work, work[10 * BATCH :])
    rough = skin[10]
    if rough > 0:
        _lookup(tiles[0], starts, skin[11], count, work, work[13 * BATCH :])
    is_glossy = light[4] * skin[9] > 0
    if is_glossy:
        _shine(skin, eye, light, count, work)
    around, contrast, tint, red, green, blue = light[3], skin[8], skin[12], skin[5], skin[6], skin[7]
    for i in range(count):
        facing = work[i + 6 * BATCH] * light[0] + work[i + 7 * BATCH] * light[1] + work[i + 8 * BATCH] * light[2]
        lit = around + (1 - around) * max(0.0, facing)
        shine = work[i + 9 * BATCH] if is_glossy else 0.0
        r, g, b = work[i + 10 * BATCH], work[i + 11 * BATCH], work[i + 12 * BATCH]
        grey = (r + g + b) / 3
        r, g, b = (
            contrast * (grey + tint * (r - grey)),
            contrast * (grey + tint * (g - grey)),
            contrast * (grey + tint * (b - grey)),
        )
        if rough > 0:
            r, g, b = (
                r + rough * work[i + 13 * BATCH],
                g + rough * work[i + 14 * BATCH],
                b + rough * work[i + 15 * BATCH],
            )
        r, g, b = max((red + r) * lit, 0.0), max((green + g) * lit, 0.0), max((blue + b) * lit, 0.0)
        work[i + 10 * BATCH], work[i + 11 * BATCH], work[i + 12 * BATCH] = r, g, b
        work[i + 13 * BATCH], work[i + 14 * BATCH], work[i + 15 * BATCH] = r + shine, g + shine, b + shine


@inner
def _sides(windows, near, count, lefts, index, y, sides):  # type: ignore[no-untyped-def]
    """How many rays across each pixel of a row gets: 4 where surfaces meet, else 2, or 1 where nothing else can."""
    height, width = index.shape
    for x in range(width):
        sides[x] = 0
    for i in range(count):
        k = near[i]
        least, most = windows[k, 0] - MARGIN, windows[k, 1] + MARGIN
        for x in range(width):
            sides[x] += least < lefts[x + 1] and most > lefts[x]
    for x in range(width):
        own = index[y, x]
        alike = index[y, max(x - 1, 0)] == own and index[y, min(x + 1, width - 1)] == own
        alike = alike and index[max(y - 1, 0), x] == own and index[min(y + 1, height - 1), x] == own
        sides[x] = 1 if sides[x] < 2 else (2 if alike else 4)


@inner
def _around(windows, above, below, found):  # type: ignore[no-untyped-def]
    """Put the surfaces that rays between two slopes down can meet into `found`; how many they are."""
    count = 0
    for k in range(windows.shape[0]):
        if windows[k, 2] - MARGIN < below and windows[k, 3] + MARGIN > above:
            found[count] = k
            count += 1
    return count


@inner
def _shade_row(kinds, rows, skins, tiles, starts, eye, spacing, light, total, rays, met, places, work, colours):  # type: ignore[no-untyped-def]
    """Shade all rays of a row, surface by surface; those that meet nothing stay black.

    Parameters
    ----------
    total, rays, met
        How many rays; (3, rays) their slopes to the right and down and their depths; the surface that each of them
        meets, -1 if there is none.
    places
        (rays,) numbers on the way.
    colours
        (rays, 6) without the highlight, and with it.
    """
    used = np.zeros(kinds.size, np.bool_)
    for i in range(total):
        if met[i] >= 0:
            used[met[i]] = True
        else:
            for c in range(6):
                colours[i, c] = 0.0
    for k in range(kinds.size):
        count = 0
        if used[k]:
            for i in range(total):
                if met[i] == k:
                    places[count] = i
                    count += 1
        for begin in range(0, count, BATCH):
            some = min(count - begin, BATCH)
            for j in range(some):
                for c in range(3):
                    work[j + c * BATCH] = rays[c, places[begin + j]]
            _shade(kinds[k], rows[k], skins[k], tiles, starts, eye, spacing, light, some, work)
            for j in range(some):
                for c in range(6):
                    colours[places[begin + j], c] = work[j + (10 + c) * BATCH]


@exact
def picture(kinds, rows, windows, skins, tiles, starts, eye, middle, focal, top, light, index, out):  # type: ignore[no-untyped-def]
    """Grey levels of a picture, each pixel the mean of 4 x 4 rays where surfaces meet, else of 2 x 2, or of 2.

    Parameters
    ----------
    middle, top, focal
        Column and row of the optical axis, and the focal length, px.
    light
        Unit vector towards the light, the share of light from everywhere, and the highlight in grey levels.
    index
        (H, W) the surface at every pixel's centre.
    out
        (2, H, W, 3) float32: without the highlight, and with it.
    """
    height, width = index.shape
    most = 20 * width  # rays of a row: two rows of two a pixel, four of four
    found, sides, lefts = np.empty(kinds.size, np.int64), np.empty(width, np.int64), np.empty(width + 1)
    rays, met, places, colours = (
        np.empty((3, most)),
        np.empty(most, np.int64),
        np.empty(most, np.int64),
        np.empty((most, 6)),
    )
    firsts = np.empty((6, width), np.int64)  # where the rays of a pixel begin
    work = np.empty(NUMBERS * BATCH)
    for x in range(width + 1):
        lefts[x] = (x - 0.5 - middle) / focal
    for y in range(height):
        near = _around(windows, (y - 0.5 - top) / focal, (y + 0.5 - top) / focal, found)
        _sides(windows, found, near, lefts, index, y, sides)
        total = np.int64(0)  # not a literal: numba would compile what it is given to once more
        for s in range(6):
            begin, down = total, (y + ((s - 0.5) * 0.5 if s < 2 else (s - 3.5) * 0.25) - top) / focal
            for x in range(width):
                firsts[s, x], side = total, sides[x]
                if (side == 4) != (s >= 2):
                    continue
                for t in range(side):
                    shift = (t - 1.5) * 0.25 if side == 4 else (t + s * (2 - side) - 0.5) * 0.5
                    rays[0, total], rays[1, total] = (x + shift - middle) / focal, down
                    total += 1
            held, rights, depths = candidates(windows, down, found), rays[0, begin:total], rays[2, begin:total]
            cast(kinds, rows, windows, found, held, eye, rights, down, total - begin, work, depths, met[begin:total])
            if s == 1:  # where a ray meets something else after all, the pixel is not alike
                for x in range(width):
                    own, i, j = index[y, x], firsts[0, x], firsts[1, x]
                    if sides[x] == 2 and not (met[i] == met[i + 1] == met[j] == met[j + 1] == own):
                        sides[x] = 4
                        met[i] = met[i + 1] = met[j] = met[j + 1] = -1
        _shade_row(kinds, rows, skins, tiles, starts, eye, 0.5 / focal, light, total, rays, met, places, work, colours)
        for x in range(width):
            side = sides[x]
            first, last = (2, 6) if side == 4 else (0, 2)
            for c in range(6):
                sum_ = 0.0
                for s in range(first, last):
                    for t in range(side):
                        sum_ += colours[firsts[s, x] + t, c]
                out[c // 3, y, x, c % 3] = sum_ / (side * max(side, 2))
