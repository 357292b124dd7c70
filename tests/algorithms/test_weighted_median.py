"""The weighted median against a plain twin."""

import numpy as np

from matbench.algorithms.weighted_median import weighted_median


def test_agrees_with_a_plain_twin() -> None:
    rng = np.random.default_rng(0)
    planes = rng.integers(0, 6, (9, 11)).astype(np.int32)
    image = rng.integers(0, 80, (9, 11, 3), np.uint8)
    wanted = rng.random((9, 11)) < 0.5
    radius, space, colour = 2, 1.5, 0.2
    expected = planes.copy()
    for y, x in zip(*np.nonzero(wanted), strict=True):
        pairs = []
        for v in range(max(0, y - radius), min(9, y + radius + 1)):
            for u in range(max(0, x - radius), min(11, x + radius + 1)):
                apart = ((image[v, u].astype(float) - image[y, x].astype(float)) ** 2).sum() / 255**2
                weight = np.exp(-((v - y) ** 2 + (u - x) ** 2) / space**2 - apart / colour**2)
                pairs.append((planes[v, u], weight))
        pairs.sort()
        sums = np.cumsum([weight for _, weight in pairs])
        expected[y, x] = pairs[int((2 * sums >= sums[-1] * (1 - 1e-12)).argmax())][0]
    for threads in (1, 2):
        np.testing.assert_array_equal(weighted_median(planes, image, wanted, radius, space, colour, threads), expected)
