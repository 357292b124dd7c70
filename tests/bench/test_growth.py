"""How work and memory grow."""

import numpy as np
import pytest
from subjects import METHODS, instance, scene

from matbench.algorithm import Context
from matbench.bench import growth
from matbench.errors import UserError


def test_exponents_are_those_of_powers() -> None:
    at = np.array([1.0, 2.0, 4.0, 8.0])
    assert growth.exponent(at, 3 * at**1.5) == pytest.approx((1.5, 1.5, 1.5))
    slope, low, high = growth.exponent(at, at * np.array([1.1, 0.9, 1.0, 1.05]))
    assert low < slope < high


# three hold no volume, and the graph of one is larger than its volumes
NO_VOLUMES = ("collins_sweep", "kolmogorov_zabih", "okutomi_kanade", "sgbm")


@pytest.mark.parametrize("name", [n for n in METHODS if n not in NO_VOLUMES])
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


def test_every_built_in_method_and_preset_can_grow() -> None:
    """Nobody need remember a new one; all use every view and whole-pixel planes where they have such a choice."""
    found = growth.methods()
    assert list(found) == list(METHODS)
    assert growth.PEER in found
    shared = {name: growth.parameters.values_of(one) for name, one in found.items()}
    assert {values["views"] for values in shared.values() if "views" in values} == {0}
    assert {values["fineness"] for values in shared.values() if "fineness" in values} == {1}


def test_only_chosen_methods_grow_beside_their_peer() -> None:
    assert growth.chosen(["voxel*"]) == ["voxel_coloring", "sgbm"]
    with pytest.raises(UserError, match="unknown method 'voxell'"):
        growth.chosen(["voxell"])
