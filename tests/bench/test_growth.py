"""How work and memory grow."""

import numpy as np
import pytest
from subjects import METHODS, instance, scene

from matbench.algorithm import Context
from matbench.bench import growth


def test_exponents_are_those_of_powers() -> None:
    at = np.array([1.0, 2.0, 4.0, 8.0])
    assert growth.exponent(at, 3 * at**1.5) == pytest.approx((1.5, 1.5, 1.5))
    slope, low, high = growth.exponent(at, at * np.array([1.1, 0.9, 1.0, 1.05]))
    assert low < slope < high


@pytest.mark.parametrize("name", [n for n in METHODS if n not in ("okutomi_kanade", "sgbm")])
def test_counted_bytes_of_volumes_are_allocated(name: str) -> None:
    """The volumes that a method counts are most of what it holds at once."""
    import tracemalloc

    large = scene(96, 64, 3, 40)
    instance(name).solve(scene(), Context(volume=False))  # compiles
    tracemalloc.start()
    try:
        counted = instance(name).solve(large, Context(volume=False)).work["volume_bytes"]
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert counted <= peak < 2 * counted
