"""An exact test of whether two methods are equal: by changing the signs of their differences.

Of two equal methods neither is the better on any scene but by chance: a difference is as likely as its negative,
whatever its distribution. So signs may be changed at will, and how the sum of the differences stands among the sums
after all such changes is known exactly (Fisher 1935, The Design of Experiments, section 21). Here not all changes of
signs are taken, but a group of them, which leaves the test exact (Koning & Hemerik 2024, Biometrika 111(2)).
"""

import numpy as np
from numpy.typing import NDArray

_BITS = 16  # the group has 2**_BITS changes, or 2**n for n values where these are fewer
_POLYNOMIAL = 0x1100B  # x^16 + x^12 + x^3 + x + 1, primitive over GF(2)
_ROUNDING = 1e-9  # relative: sums that differ by less count as equal


def chance(values: NDArray[np.float64]) -> float:
    """The share of changes of signs after which the sum is as far from 0 as it is, or farther.

    If every value is as likely as its negative, whatever the others are, this is at most a with a chance of at most a.
    For up to 16 values it is over all changes of signs. Beyond, the k-th value changes its sign in a change c, a vector
    of 16 bits, if the scalar product of c and the k-th power of a primitive element of GF(2^16) is odd. So any 16
    values in a row change their signs in all ways, and all changes together are a group.

    Parameters
    ----------
    values
        (n,) float64, finite, n at least 1.
    """
    bits = min(values.size, _BITS)
    sums = np.zeros(1 << bits)
    np.add.at(sums, powers(values.size), values)
    for bit in range(bits):  # the Walsh-Hadamard transform: sums[c] becomes the sum after change c
        pairs = sums.reshape(-1, 2, 1 << bit)
        pairs[:, 0], pairs[:, 1] = pairs[:, 0] + pairs[:, 1], pairs[:, 0] - pairs[:, 1]
    far = np.abs(sums)
    return float(np.mean(far >= far[0] - _ROUNDING * np.abs(values).sum()))


def powers(count: int) -> NDArray[np.int64]:
    """(count,) the first powers of the primitive element, as numbers of 16 bits.

    >>> powers(3).tolist()
    [1, 2, 4]
    """
    found, power = np.empty(count, np.int64), 1
    for k in range(count):
        found[k] = power
        power <<= 1
        if power >> _BITS:
            power ^= _POLYNOMIAL
    return found
