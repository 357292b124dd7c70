"""Means over windows against a plain walk over target points and window taps."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from neighbours import around, like_middle, random_scene

from matbench.algorithms.features import UNITS, luma, strengthened
from matbench.algorithms.sampling import fine_rows
from matbench.algorithms.similarity import Matcher, Matching


def whole(values):
    """Grey levels rounded to `UNITS`, as the kernels keep them where they mix costs."""
    return np.rint(values * np.float32(UNITS)).astype(float) / UNITS


def slope(row, sample, q):
    """Half the difference of the samples one pixel to either side, those beyond an edge taken from it."""
    return (row[min(sample + q, row.size - 1)] - row[max(sample - q, 0)]) / np.float32(2)


def slopes_of(grey, q, texture):
    """(views, H, samples) slopes, which `test_features` tells to be made as strong as texture."""
    own = np.empty_like(grey)
    for view, y, sample in np.ndindex(grey.shape):
        own[view, y, sample] = slope(grey[view, y], sample, q)
    return whole(strengthened(own, q, texture))


def darker(grey, y, sample, q):
    """Which of the 7x7 pixels around are darker."""
    return around(grey, y, sample, q) < grey[y, sample]


def differing(order, like):
    """h: how many of the 48 pixels are darker in one view only, scaled up from those alike in both."""
    if like is None:
        return np.sum(order[0] != order[1])
    both = like[0] & like[1]
    return 48 * np.sum((order[0] != order[1]) & both) / both.sum()


def twin(matcher: Matcher) -> np.ndarray:
    """exp(-MSD / sigma^2), exp(-RMS / sigma), 1 - MSD / M or 1 - the mean cost, tap by tap."""
    space, how = matcher.space, matcher.settings
    rows = fine_rows(matcher.scene.views, space.fineness)
    grey = luma(rows)  # in float32, as a pixel is darker than another by their last bits, too
    if not how.colour:
        rows = np.repeat(grey[:, None], 3, axis=1)
    slopes = slopes_of(grey, space.fineness, how.texture)
    fine, rows = whole(rows), rows.astype(float)
    limit, radius, q = how.truncation or np.inf, how.window // 2, space.fineness
    out = np.zeros((space.rows, len(matcher.pairs), space.planes, space.columns))
    for y, p, k, c in np.ndindex(out.shape):
        i, j = matcher.pairs[p]
        ui, uj = c - space.start(i, k), c - space.start(j, k)
        if not (0 <= ui < space.samples and 0 <= uj < space.samples):
            continue
        taps = []
        for dy in range(-radius, radius + 1):
            for dx in range(-radius * q, radius * q + 1, q):
                inside = 0 <= y + dy < space.rows
                if inside and min(ui, uj) + dx >= 0 and max(ui, uj) + dx < space.samples:
                    gap = rows[i, :, y + dy, ui + dx] - rows[j, :, y + dy, uj + dx]
                    if how.similarity not in ("mixed", "census"):
                        taps.append(min(np.mean(gap**2), limit**2))
                        continue
                    at = (i, ui + dx), (j, uj + dx)
                    order = [darker(grey[v], y + dy, u, q) for v, u in at]
                    like = [like_middle(fine[v], y + dy, u, q, how.alike) for v, u in at] if how.alike else None
                    cost = min(differing(order, like), 20) / 20
                    if how.similarity == "mixed":
                        steep = [slopes[v, y + dy, u] for v, u in at]
                        cost *= 0.40
                        gap = fine[i, :, y + dy, ui + dx] - fine[j, :, y + dy, uj + dx]
                        cost += 0.35 * min(np.mean(np.abs(gap)), limit) / 20
                        cost += 0.25 * min(abs(steep[0] - steep[1]), 10) / 10
                    taps.append(cost)
        mean = np.mean(taps)
        forms = {
            "ssd": np.exp(-mean / how.sigma**2),
            "rms": np.exp(-np.sqrt(mean) / how.sigma),
            "linear": max(0.0, 1 - mean / (how.truncation or 255) ** 2),
        }
        out[y, p, k, c] = forms.get(how.similarity, max(0.0, 1 - mean))
    return out


@settings(max_examples=25, deadline=None)
@given(
    n=st.integers(2, 4),
    height=st.integers(1, 5),
    width=st.integers(1, 7),
    least=st.integers(-2, 1),
    extent=st.integers(0, 3),
    fineness=st.integers(1, 3),
    window=st.sampled_from([1, 3, 5]),
    which=st.sampled_from(["all", "consecutive", "reference"]),
    form=st.sampled_from(["ssd", "rms", "linear", "census", "mixed"]),
    truncation=st.sampled_from([0.0, 60.0]),
    colour=st.booleans(),
    most=st.sampled_from([0.0, 30.5, 100.5]),
    texture=st.sampled_from([0.0, 6.0, 90.0]),
    seed=st.integers(0, 99),
)
def test_similarity_is_its_equation(
    n, height, width, least, extent, fineness, window, which, form, truncation, colour, most, texture, seed
):
    scene = random_scene(n, height, width, least, least + extent, seed)
    matcher = Matcher.of(
        scene,
        Matching(
            views=0,
            fineness=fineness,
            pairs=which,
            similarity=form,
            window=window,
            sigma=70.0,
            truncation=truncation,
            colour=colour,
            alike=most,
            texture=texture,
        ),
    )
    rho, expected = matcher.all(), twin(matcher)
    # half a byte of rounding
    assert np.abs(rho / 255 - expected).max() <= 0.5 / 255 + 2e-5
    assert not rho[expected == 0].any()
