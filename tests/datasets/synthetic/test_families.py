"""Families of random worlds are harder in what they are named after."""

from functools import cache

import numpy as np
import pytest

from matbench.datasets.synthetic import random_worlds, solids
from matbench.datasets.synthetic.families import FAMILIES, Dials
from matbench.datasets.synthetic.materials import NUMBERS

SEEDS = range(50)

draw = cache(random_worlds.draw)


def share(family: str, seen: set[int]) -> float:
    found = [one.kind in seen for seed in SEEDS for one in draw(seed, family).solids]
    return float(np.mean(found))


def test_families_have_one_difficulty_dialled_up() -> None:
    count = {family: np.mean([len(draw(seed, family).solids) for seed in SEEDS]) for family in FAMILIES}
    assert count["occlusion"] > 1.3 * count["mixed"]
    assert share("thin", {solids.TUBE, solids.LEAF, solids.RING}) > 1.5 * share(
        "mixed", {solids.TUBE, solids.LEAF, solids.RING}
    )
    contrast = {
        family: np.median([one.skin.contrast for seed in SEEDS for one in draw(seed, family).solids])
        for family in FAMILIES
    }
    assert contrast["weak"] < contrast["mixed"] / 3
    repeating = {*NUMBERS["cloth"], *NUMBERS["stripes"]}
    periodic = {
        family: np.mean([one.skin.tile in repeating for seed in SEEDS for one in draw(seed, family).solids])
        for family in FAMILIES
    }
    assert periodic["repetition"] > 2 * periodic["mixed"]
    noise = {family: np.mean([draw(seed, family).strengths.noise for seed in SEEDS]) for family in FAMILIES}
    assert noise["photometric"] > 1.5 * noise["mixed"]


@pytest.mark.parametrize("family", FAMILIES)
def test_what_a_family_names_can_be_drawn(family: str) -> None:
    dials = FAMILIES[family]
    for named in (dials.kinds, dials.backgrounds):
        assert all(callable(getattr(random_worlds._World, f"_{kind}")) for kind in named)
        assert min(named.values()) > 0
    assert set(dials.materials) <= set(NUMBERS)
    assert dials == Dials() if family == "mixed" else dials != Dials()
