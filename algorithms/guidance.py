"""The guided filter (He, Sun & Tang 2013): values smoothed so that their edges are those of a picture."""

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from matbench.algorithms.kernels import kernel
from matbench.algorithms.sweep import window_sums

BYTES = 4 * 21  # that a guide and a filter take for each pixel


@frozen(eq=False)
class Guidance:
    """A picture that guides: in every window, values are explained as a linear function of its colours.

    K. He, J. Sun, X. Tang, "Guided image filtering", IEEE PAMI 35(6), 2013, with the colours of the picture.

    Parameters
    ----------
    picture
        (H, W, 3) float32 colours, 0 to 1.
    side
        Of the windows, in pixels; they end with the picture.
    share
        (H, W) 1 over the number of pixels in a window.
    mean
        (H, W, 3) of the colours in the windows.
    inverse
        (H, W, 6) (covariance of the colours + epsilon)^-1: of each row what is on the diagonal or right of it.
    """

    picture: NDArray[np.float32]
    side: int
    share: NDArray[np.float32]
    mean: NDArray[np.float32]
    inverse: NDArray[np.float32]

    @classmethod
    def of(cls, image: NDArray[np.uint8], radius: int, epsilon: float) -> "Guidance":
        """Prepare a picture (H, W, 3) uint8; colours that vary by less than epsilon count as flat."""
        picture, side = image.astype(np.float32) / np.float32(255), 2 * radius + 1
        share = np.float32(1) / window_sums(np.ones(picture.shape[:2], np.float32), side)
        mean = window_sums(picture, side) * share[:, :, None]
        first = window_sums(picture * picture[:, :, :1], side)
        others = window_sums(picture[:, :, [1, 1, 2]] * picture[:, :, [1, 2, 2]], side)
        inverse = np.empty((*picture.shape[:2], 6), np.float32)
        invert(first, others, mean, share, epsilon, inverse)
        return cls(picture, side, share, mean, inverse)

    def filter(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """(H, W) finite values -> their smoothed version."""
        parts = np.empty((*values.shape, 4), np.float32)
        weigh(self.picture, values, parts)
        sums = window_sums(parts, self.side)
        explain(sums, self.share, self.mean, self.inverse, parts)
        out = np.empty(values.shape, np.float32)
        apply(window_sums(parts, self.side), self.share, self.picture, out)
        return out


@kernel
def invert(first, others, mean, share, epsilon, out):  # type: ignore[no-untyped-def]
    """out <- the upper triangles of (covariance + epsilon)^-1.

    Parameters
    ----------
    first, others
        (H, W, 3) sums of the products of colours: 0 with 0, 1 and 2; and 1 with 1, 1 with 2, 2 with 2; in windows.
    """
    for y in range(share.shape[0]):
        for x in range(share.shape[1]):
            m, part = mean[y, x], np.float64(share[y, x])
            a = first[y, x, 0] * part - np.float64(m[0]) * m[0] + epsilon
            b = first[y, x, 1] * part - np.float64(m[0]) * m[1]
            c = first[y, x, 2] * part - np.float64(m[0]) * m[2]
            d = others[y, x, 0] * part - np.float64(m[1]) * m[1] + epsilon
            e = others[y, x, 1] * part - np.float64(m[1]) * m[2]
            f = others[y, x, 2] * part - np.float64(m[2]) * m[2] + epsilon
            one, two, three = d * f - e * e, c * e - b * f, b * e - c * d
            scale = 1 / (a * one + b * two + c * three)
            out[y, x, 0], out[y, x, 1], out[y, x, 2] = one * scale, two * scale, three * scale
            out[y, x, 3], out[y, x, 4] = (a * f - c * c) * scale, (b * c - a * e) * scale
            out[y, x, 5] = (a * d - b * b) * scale


@kernel
def weigh(picture, values, out):  # type: ignore[no-untyped-def]
    """out <- (H, W, 4) colours times values, and the values."""
    for y in range(values.shape[0]):
        for x in range(values.shape[1]):
            value = values[y, x]
            for c in range(3):
                out[y, x, c] = picture[y, x, c] * value
            out[y, x, 3] = value


@kernel
def explain(sums, share, mean, inverse, out):  # type: ignore[no-untyped-def]
    """out <- (H, W, 4) slopes and offset of the function of the colours that explains the values of a window."""
    for y in range(share.shape[0]):
        for x in range(share.shape[1]):
            part = share[y, x]
            m, i = mean[y, x], inverse[y, x]
            average = sums[y, x, 3] * part
            r, g, b = (
                sums[y, x, 0] * part - m[0] * average,
                sums[y, x, 1] * part - m[1] * average,
                sums[y, x, 2] * part - m[2] * average,
            )
            red, green, blue = (
                i[0] * r + i[1] * g + i[2] * b,
                i[1] * r + i[3] * g + i[4] * b,
                i[2] * r + i[4] * g + i[5] * b,
            )
            out[y, x, 0], out[y, x, 1], out[y, x, 2] = red, green, blue
            out[y, x, 3] = average - (red * m[0] + green * m[1] + blue * m[2])


@kernel
def apply(sums, share, picture, out):  # type: ignore[no-untyped-def]
    """out <- the mean function of the windows around a pixel, of its colours."""
    for y in range(share.shape[0]):
        for x in range(share.shape[1]):
            total = sums[y, x, 3]
            for c in range(3):
                total += sums[y, x, c] * picture[y, x, c]
            out[y, x] = total * share[y, x]
