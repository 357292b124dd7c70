"""Random numbers for drawing a world: they stay the same with every version of NumPy, and on every machine."""

from collections.abc import Mapping, Sequence
from math import exp, log
from typing import TypeVar

from matbench.datasets.synthetic.surfaces import Vector
from matbench.datasets.synthetic.textures import random_bytes

T = TypeVar("T")
_STOCK = 1 << 14  # bytes that are made at a time
_DIGITS = 9  # of what comes from exp and log, which libraries round differently in the last place


class Dice:
    """A stream of random numbers.

    Parameters
    ----------
    seed
        Whole numbers from 0; another sequence of them is another stream.
    """

    def __init__(self, *seed: int) -> None:
        self._seed, self._turn, self._stock = seed, 0, b""

    def bits(self) -> int:
        """A whole number of 48 bits."""
        if not self._stock:
            self._stock = random_bytes((*self._seed, self._turn), _STOCK - _STOCK % 6).tobytes()
            self._turn += 1
        drawn, self._stock = self._stock[:6], self._stock[6:]
        return int.from_bytes(drawn, "little")

    def share(self) -> float:
        """From 0 to below 1."""
        return self.bits() / (1 << 48)

    def between(self, least: float, largest: float) -> float:
        """Uniformly distributed."""
        return least + (largest - least) * self.share()

    def log(self, least: float, largest: float) -> float:
        """Its logarithm is uniformly distributed."""
        return round(exp(self.between(log(least), log(largest))), _DIGITS)

    def whole(self, least: int, largest: int) -> int:
        """Both ends included."""
        return least + int(self.share() * (largest - least + 1))

    def chance(self, share: float) -> bool:
        return self.share() < share

    def one(self, choices: Sequence[T]) -> T:
        return choices[int(self.share() * len(choices))]

    def weighed(self, weights: Mapping[T, float]) -> T:
        """One of the keys, as often as its weight says."""
        left = self.share() * sum(weights.values())
        for key, weight in weights.items():
            left -= weight
            if left < 0:
                return key
        return next(reversed(list(weights)))

    def turn(self, largest: float = 1.0) -> tuple[float, float]:
        """Cosine and sine of an angle whose half has a tangent from -largest to largest: 1 is a quarter turn."""
        t = self.between(-largest, largest)
        return (1 - t * t) / (1 + t * t), 2 * t / (1 + t * t)

    def frame(self, tilt: float) -> tuple[Vector, Vector, Vector]:
        """Three unit vectors upright on one another: turned about Z by anything, then tilted about Y and X."""
        (a, b), (c, d), (e, f) = self.turn(), self.turn(tilt), self.turn(tilt)

        def turned(x: float, y: float, z: float) -> Vector:
            x, y = a * x - b * y, b * x + a * y
            x, z = c * x + d * z, c * z - d * x
            y, z = e * y - f * z, f * y + e * z
            return x, y, z

        return turned(1, 0, 0), turned(0, 1, 0), turned(0, 0, 1)
