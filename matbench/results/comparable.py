"""Which scores may be compared: a region must hold enough pixels, and a method must answer enough of them."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from matbench.measures.metrics import ENOUGH
from matbench.regions import counts

SILENT = "answers too little"
"""The verdict on a difference if one side answers less than `ENOUGH` per cent of the pixels."""


def counted(results: pd.DataFrame) -> NDArray[np.bool_]:
    """(rows,) which rows of ``results.csv`` enter means over scenes.

    A row is left out if its region is too small in its scene (`matbench.regions.counts`), or if no method has a value
    there. This depends only on scene, region and metric, so it is the same for all methods.
    """
    whole = results["pixels"].where(results["region"] == "all")
    known = whole.groupby([results["scene"], results["metric"]]).transform("max").fillna(results["pixels"])
    # few different sizes occur, so each is asked about once
    first, pixels = map(np.asarray, pd.factorize(results["pixels"]))
    second, of = map(np.asarray, pd.factorize(known))
    place, sizes = pd.factorize(first * np.int64(len(of)) + second)
    answers = [counts(int(pixels[size // len(of)]), int(of[size % len(of)])) for size in sizes]
    holds = np.array(answers, bool)[place] & (first >= 0)  # a damaged table may not say how many pixels
    keys = [results[name] for name in ("scene", "region", "metric")]
    has = results["value"].notna().groupby(keys).transform("any").to_numpy(bool)
    both: NDArray[np.bool_] = holds & has
    return both


def is_enough(answered: float) -> bool:
    """May a score over `answered` per cent of the pixels be ranked? Yes if the share is unknown (NaN)."""
    # a comparison with NaN is False: this way round it says yes
    return not answered < ENOUGH
