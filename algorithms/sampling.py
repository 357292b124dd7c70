"""Image rows sampled finer than a pixel, so that matching samples in fine planes have whole-number places.

See docs/concepts/disparity-space.md.
"""

from fractions import Fraction
from math import ceil, lcm

import numpy as np
from attrs import evolve
from numpy.typing import NDArray

from matbench.algorithms.features import whole
from matbench.algorithms.kernels import kernel, literal
from matbench.algorithms.parallel import over_views
from matbench.scene import SAME_PLACE, Scene
from matbench.space import DisparitySpace


@literal
def _between(pixels, weights, phase, fineness, row):  # type: ignore[no-untyped-def]
    """Samples of one phase, each from the four pixels around it; `pixels` has one more at either end."""
    w0, w1, w2, w3 = weights[0], weights[1], weights[2], weights[3]
    for x in range(np.uintp(pixels.size - 3)):
        row[fineness * x + phase] = (
            w0 * pixels[x] + w1 * pixels[x + np.uintp(1)] + w2 * pixels[x + np.uintp(2)] + w3 * pixels[x + np.uintp(3)]
        )


@kernel
def _sample_rows(image, weights, top, end, fine):  # type: ignore[no-untyped-def]
    _, width, channels = image.shape
    fineness = np.uintp(weights.shape[0])
    pixels = np.empty(width + 2, np.float32)
    for c in range(channels):
        for y in range(top, end):
            for x in range(width):
                pixels[x + 1] = np.float32(image[y, x, c])
            pixels[0], pixels[width + 1] = pixels[1], pixels[width]
            row = fine[c, y]
            for x in range(np.uintp(width)):
                row[fineness * x] = pixels[x + np.uintp(1)]
            for phase in range(1, fineness):
                _between(pixels, weights[phase], np.uintp(phase), fineness, row)


def fine_rows(images: NDArray[np.uint8], fineness: int, threads: int = 1) -> NDArray[np.float32]:
    """Sample the rows of images `fineness` times finer by cubic convolution.

    Sample m lies at column m / fineness; samples on whole pixels keep their value. The kernel is
    that of Keys 1981 (a = -1/2); beyond the edge the edge pixel is repeated.

    Parameters
    ----------
    images
        (n, H, W, 3) uint8.
    fineness
        q >= 1.

    Returns
    -------
    (n, 3, H, q * (W - 1) + 1) float32, colours planar, in grey levels (cubic overshoot included).
    """
    n, height, width, channels = images.shape
    t = np.arange(fineness) / fineness
    taps = ((2 - t) * t - 1) * t / 2, ((3 * t - 5) * t * t + 2) / 2, ((4 - 3 * t) * t + 1) * t / 2, (t - 1) * t * t / 2
    weights = np.stack(taps, axis=1).astype(np.float32)
    fine = np.empty((n, channels, height, fineness * (width - 1) + 1), np.float32)
    over_views(lambda view, top, end: _sample_rows(images[view], weights, top, end, fine[view]), n, height, threads)
    return fine


def by_phase(
    values: NDArray[np.generic], fineness: int, spare: int = 0, threads: int = 1, shift: float | None = None
) -> NDArray[np.generic]:
    """Sort finely sampled rows by their phase within a pixel, so that samples a pixel apart lie side by side.

    Parameters
    ----------
    values
        (n, ..., q * (W - 1) + 1), such as from `fine_rows`.
    fineness
        q.
    spare
        Columns of 0 after the last pixel.
    shift
        If it is given, samples become `whole` numbers, with that shift.

    Returns
    -------
    (n, q, ..., W + spare): sample ``q * x + phase`` of a row at ``[:, phase, ..., x]``; 0 where that lies
    beyond the last pixel.
    """
    width = (values.shape[-1] - 1) // fineness + 1
    kind = values.dtype if shift is None else np.uint16
    out = np.zeros((values.shape[0], fineness, *values.shape[1:-1], width + spare), kind)

    def sort(view: int, top: int, end: int) -> None:
        # some rows at a time: whole numbers of all views would take as much memory again
        some = values[view : view + 1, ..., top:end, :]
        one = (some if shift is None else whole(some, shift))[0]  # type: ignore[arg-type]
        for phase in range(fineness):
            part = one[..., phase::fineness]
            out[view, phase, ..., top:end, : part.shape[-1]] = part

    over_views(sort, len(values), values.shape[-2], threads)
    return out


MOST_PARTS = 8
"""Of a view step: a finer grid takes as many more samples of each row."""


def grid(scene: Scene) -> tuple[Scene, tuple[int, ...]] | None:
    """The scene per step of a grid on which all of its views lie, and each view's place; None if there is no such grid.

    What has a disparity of d pixels per view step has d / m per step of the grid, m steps of which are a view step.

    >>> import numpy as np
    >>> from matbench import Range, Scene
    >>> views = np.zeros((3, 2, 2, 3), np.uint8)
    >>> scene = Scene("three", views, ("0", "1", "2"), 0, Range(0, 4), {}, 1, positions=(0, 1, 2.5))
    >>> per_step, places = grid(scene)
    >>> places, per_step.disparities, per_step.pair_steps
    ((0, 2, 5), Range(least=0.0, largest=2.0), 2)
    """
    parts = [Fraction(position).limit_denominator(MOST_PARTS) for position in scene.places]
    if any(abs(float(part) - position) > SAME_PLACE for part, position in zip(parts, scene.places, strict=True)):
        return None
    m = lcm(*(part.denominator for part in parts))
    if m > MOST_PARTS:
        return None
    scaled = evolve(
        scene,
        disparities=scene.disparities.scaled(1 / m),
        pair_steps=scene.pair_steps * m,
        positions=tuple(position * m for position in scene.places),
        truth={},
        regions={},
        visible={},
        held_out=None,
    )
    return (scaled if m > 1 else scene), tuple(int(part * m) for part in parts)


def off_grid(scene: Scene) -> str | None:
    """Why a scene has no `grid`, in words; None if it has one."""
    if grid(scene) is not None:
        return None
    return f"it samples views on a grid, and these, at {scene.where}, lie on none of up to {MOST_PARTS} parts of a step"


class OnGrid:
    """What methods say that sample views on a `grid`: their steps may be uneven."""

    @property
    def uneven(self) -> bool:
        """Costs that are shared with materiality come from a space whose views lie at even steps."""
        return getattr(getattr(self, "costs", self), "similarity", "published") == "published"

    def unsupported_reason(self, scene: Scene) -> str | None:
        """Why a scene cannot be sampled, in words."""
        return off_grid(scene)


def search_space(scene: Scene, fineness: int = 0) -> DisparitySpace:
    """The disparity space that covers a scene's range.

    Parameters
    ----------
    fineness
        Planes per pixel of view step; 0 makes planes at most one pixel of the field's pair apart.
    """
    q = fineness or max(1, ceil(scene.pair_steps - 1e-6))
    return DisparitySpace.covering(scene.disparities, scene.n, scene.height, scene.width, q)
