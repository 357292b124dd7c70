"""The limits of the machine: what is measured computes what it says."""

import numpy as np
import pytest

from matbench.bench import roofline
from matbench.bench.roofline import Roofline


def test_what_is_timed_is_the_triad_and_the_polynomial() -> None:
    random = np.random.default_rng(0)
    a, b, c = random.random((3, 99), np.float32)
    roofline._triad(a, b, c, np.float32(0.5))
    np.testing.assert_allclose(a, b + 0.5 * c, rtol=1e-6)
    x, factors = random.random(50, np.float32), random.random(33, np.float32)
    expected = np.polyval(factors.astype(float), x.astype(float))
    roofline._horner(x, factors, 1)
    np.testing.assert_allclose(x, expected, rtol=1e-4)


def test_of_several_measurements_the_higher_limits_count() -> None:
    assert Roofline(10, 50).best(Roofline(12, 40)) == Roofline(12, 50)


def test_a_machine_has_limits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(roofline, "_TRIAD", 1 << 16)
    found = roofline.measure(repeats=2)
    assert 0.05 < found.bandwidth < 1e4
    assert 0.05 < found.arithmetic < 1e4
