"""Which scores enter means, and which may be ranked."""

import numpy as np
import pandas as pd

from matbench.measures.metrics import ENOUGH
from matbench.results.comparable import counted, is_enough


def test_a_region_counts_by_its_pixels_for_all_methods_alike() -> None:
    sizes = {("s", "all"): 43200, ("s", "textureless"): 34230, ("t", "all"): 43200, ("t", "textureless"): 1}
    rows = [
        (method, scene, region, "bad_1", 1.0, pixels) for method in "ab" for (scene, region), pixels in sizes.items()
    ]
    results = pd.DataFrame(rows, columns=["algorithm", "scene", "region", "metric", "value", "pixels"])
    assert counted(results).tolist() == [True, True, True, False] * 2
    # one method without a value: the scene still counts, and its mean is missing; none with a value: it does not
    results.loc[1, "value"] = np.nan
    assert counted(results)[[1, 5]].tolist() == [True, True]
    results.loc[5, "value"] = np.nan
    assert counted(results)[[1, 5]].tolist() == [False, False]


def test_a_damaged_row_does_not_count() -> None:
    rows = [("s", "all", "bad_1", 1.0, 100), ("s", "all", "bad_1", 1.0, np.nan), ("t", "all", "bad_1", 1.0, 100)]
    results = pd.DataFrame(rows, columns=["scene", "region", "metric", "value", "pixels"])
    assert counted(results).tolist() == [True, False, True]
    assert counted(results.iloc[:0]).tolist() == []


def test_a_prediction_is_measured_against_its_own_view() -> None:
    rows = [("t", "all", "bad_1", 1.0, 100000), ("t", "all", "prediction_psnr", 30.0, 150)]
    results = pd.DataFrame(rows, columns=["scene", "region", "metric", "value", "pixels"])
    assert counted(results).all()


def test_enough() -> None:
    assert is_enough(ENOUGH)
    assert is_enough(np.nan), "nobody knows"
    assert not is_enough(ENOUGH - 0.1)
