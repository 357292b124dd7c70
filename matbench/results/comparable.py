"""Which scores may stand beside others: what a region must hold to count, and how much of it must be answered."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from matbench.measures.metrics import ENOUGH
from matbench.regions import counts

SILENT = "answers too little"
"""The verdict on a difference where one side is over fewer than `ENOUGH` of the pixels."""


def counted(results: pd.DataFrame) -> NDArray[np.bool_]:
    """Which rows of ``results.csv`` enter means over scenes.

    Not those of scenes whose region holds too little (`matbench.regions.counts`), nor those in which no method has a
    value. Whether a region counts is a matter of scene, region and metric, so that it is the same for all methods.
    """
    whole = results["pixels"].where(results["region"] == "all")
    known = whole.groupby([results["scene"], results["metric"]]).transform("max").fillna(results["pixels"])
    place, sizes = pd.MultiIndex.from_arrays([results["pixels"], known]).factorize()
    holds = np.array([counts(int(pixels), int(of)) for pixels, of in sizes], bool)[place]
    keys = [results[name] for name in ("scene", "region", "metric")]
    has = results["value"].notna().groupby(keys).transform("any").to_numpy(bool)
    both: NDArray[np.bool_] = holds & has
    return both


def is_enough(answered: float) -> bool:
    """Is a score over so much of the pixels, in per cent, that it may be ranked? Yes where nobody knows (NaN)."""
    return not answered < ENOUGH
