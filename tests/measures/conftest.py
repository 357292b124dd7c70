"""Fixtures of the tests in this folder."""

import pytest
from exact_volumes import SMALL

from matbench.datasets.synthetic import materiality
from matbench.measures.volumes import StoredVolume
from matbench.space import Volume


@pytest.fixture(scope="module")
def exact() -> tuple[Volume, StoredVolume]:
    volume = materiality("box", SMALL, fineness=2)
    return volume, StoredVolume.of(volume)
