"""Maps as pictures that can be read back."""

import numpy as np
import pytest
from attrs import evolve
from pictures_read import read

from matbench.reports.content import Report
from matbench.reports.encoding import FINER, Coding, photograph, side_for


@pytest.mark.parametrize("span", [3.0, 60.0, 254.5, 700.0])
def test_a_map_is_read_back_within_half_a_step(report: Report, span: float) -> None:
    scene = next(iter(report.scenes.values()))
    random = np.random.default_rng(0)
    values = random.uniform(0, span, (40, 50)).astype(np.float32)
    values[:3] = np.nan
    coding = Coding.of(evolve(scene, disparities=type(scene.disparities)(0, span), truth={}, regions={}))
    rows = read(coding.encode(values, 2.0, 512))
    assert rows.shape == (80, 50)
    coarse, fine = rows[:40].astype(float), rows[40:].astype(float)
    found = np.where(coarse > 0, coding.low + coding.step * (FINER * (coarse / coding.gain - 1) + fine), np.nan)
    assert np.array_equal(np.isnan(found), np.isnan(values))
    assert np.nanmax(np.abs(found - 2 * values.astype(np.float64))) <= coding.step / 2 + 1e-4
    assert coding.step <= max(0.125, (2 * span + 8) / 2000)


def test_pictures_are_bounded() -> None:
    assert read(photograph(np.zeros((300, 1024, 3), np.uint8), 512)).shape == (150, 512, 3)
    assert side_for(1) == 1024
    assert side_for(10 * 14) > 512, "ten methods on ten scenes of quarter size"
    assert side_for(10**6) == 160
