"""Scores of volumes: by hand, against a loop over points, and on exact materialities."""

import numpy as np
import pytest
from exact_volumes import SMALL, along

from matbench.datasets.synthetic import SYNTHETIC
from matbench.measures.volume_metrics import (
    METRICS,
    brier,
    calibration_error,
    f_score,
    precision,
    recall,
    reliability,
)
from matbench.measures.volumes import Rays, StoredVolume
from matbench.space import Volume


def _rays(surface_planes: list[float], *rows: list[float]) -> Rays:
    return Rays(np.array(rows, np.float32), np.array(surface_planes, float))


def test_by_hand() -> None:
    # surfaces in plane 2; the first ray is right, the second in front, the third only behind, the fourth empty
    rays = _rays([2, 2, 2, 2], [0, 0, 1, 0, 0, 0], [0, 0, 0, 0, 0, 0.5], [1, 0, 0, 0, 0, 0], [0, 0, 0.49, 0, 0, 0])
    assert precision(rays, 1) == 50
    assert recall(rays, 1) == 25
    assert f_score(rays, 1) == pytest.approx(100 / 3)
    # what is not farther away than the tolerance is found, on either side; ties count as found
    assert recall(rays, 2) == 50
    assert precision(rays, 3) == 100
    assert recall(rays, 3) == 75


def test_nothing_material_is_no_precision_and_no_score() -> None:
    rays = _rays([1, 1], [0, 0, 0], [0, 0, 0])
    assert np.isnan(precision(rays, 1))
    assert recall(rays, 1) == f_score(rays, 1) == 0


def test_everything_material_finds_all_and_is_mostly_wrong() -> None:
    rays = Rays(np.ones((5, 20), np.float32), np.full(5, 3.0))
    assert recall(rays, 1) == 100
    assert precision(rays, 1) == pytest.approx(100 * 3 / (3 + 15))  # planes 2, 3, 4 of 2..19


def _slow(rays: Rays, tolerance: float) -> tuple[float, float, float]:
    """The twin: precision, recall and Brier score, point by point."""
    right = wrong = found = 0
    squares = []
    for ray, place in zip(rays.materiality, rays.surface, strict=True):
        hit = False
        for plane, value in enumerate(ray):
            if value >= 0.5 and plane > place + tolerance + 1e-4:
                wrong += 1
            elif value >= 0.5 and plane >= place - tolerance - 1e-4:
                right, hit = right + 1, True
            if plane >= round(place):
                squares.append((float(value) - (plane == round(place))) ** 2)
        found += hit
    return 100 * right / (right + wrong), 100 * found / len(rays.surface), float(np.mean(squares))


def test_slow_twin() -> None:
    rng = np.random.default_rng(0)
    rays = Rays(rng.random((60, 14), np.float32), rng.uniform(-1, 14, 60))
    for tolerance in (0.5, 1, 2):
        found = precision(rays, tolerance), recall(rays, tolerance), brier(rays)
        assert found == pytest.approx(_slow(rays, tolerance))


def test_reliability_of_a_calibrated_and_of_an_overconfident_volume() -> None:
    rng = np.random.default_rng(0)
    predicted = rng.random((4000, 1)).astype(np.float32)
    there = rng.random((4000, 1)) < predicted
    # one plane before the nearest possible surface, or in it
    rays = Rays(predicted, np.where(there[:, 0], 0.0, -1.0))
    curve = reliability(rays)
    assert curve["points"].sum() == 4000
    assert (curve["materiality"] - curve["observed"]).abs().max() < 0.07
    assert calibration_error(rays) < 0.03
    assert brier(rays) == pytest.approx(1 / 6, abs=0.01)  # the mean of p (1 - p)
    sure = Rays(np.round(predicted), rays.surface)
    assert calibration_error(sure) == pytest.approx(0.25, abs=0.02)
    assert brier(sure) > 1.4 * brier(rays)


def test_what_lies_behind_the_surface_does_not_count() -> None:
    rng = np.random.default_rng(0)
    clean = np.zeros((30, 20), np.float32)
    place = rng.integers(3, 18, 30)
    clean[np.arange(30), place] = 0.8
    noisy = np.where(np.arange(20) < place[:, None] - 2, rng.random((30, 20)), clean).astype(np.float32)
    assert (noisy != clean).any()
    for metric in METRICS:
        values = [metric.compute(Rays(values, place.astype(float))) for values in (clean, noisy)]
        assert values[0] == values[1], metric.name


def test_exact_materialities_are_perfect_and_shifted_ones_are_not(exact: tuple[Volume, StoredVolume]) -> None:
    volume, stored = exact
    scene = SYNTHETIC.load("box", SMALL, None)
    rays = along(stored, scene)
    assert rays.materiality.shape == (scene.height * scene.width, volume.space.planes)
    assert recall(rays, 1) == 100
    assert precision(rays, 1) > 98, "but for what only another view's rays meet at the edges"
    assert brier(rays) < 0.01
    shifted = Volume(volume.space, np.roll(volume.values, 4, axis=1), volume.views)  # four planes nearer
    wrong = along(StoredVolume.of(shifted), scene)
    assert f_score(wrong, 1) < 15
    assert brier(wrong) > 10 * brier(rays)
