"""Scenes that are computed: exact truth and visibility in every view, the same on every machine.

Each tests one difficulty; `worlds` says which. What cameras do to a picture (`cameras`) is an
option of every scene: ``synthetic/fence[n=5 noise=4 gain=0.2 seed=3]``.
"""

from matbench.datasets.synthetic.scenes import OPTIONS, SYNTHETIC, materiality
from matbench.datasets.synthetic.worlds import WORLDS

__all__ = ["OPTIONS", "SYNTHETIC", "WORLDS", "materiality"]
