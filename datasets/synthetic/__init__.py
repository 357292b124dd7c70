"""Computed scenes, with exact truth and visibility in every view; they are the same on every machine.

Each scene tests one difficulty (see `worlds`). Every scene has options for the faults of cameras (see
`cameras`): ``synthetic/fence[n=5 noise=4 gain=0.2 seed=3]``.
"""

from matbench.datasets.synthetic.asking import OPTIONS
from matbench.datasets.synthetic.scenes import SYNTHETIC, materiality
from matbench.datasets.synthetic.worlds import WORLDS

__all__ = ["OPTIONS", "SYNTHETIC", "WORLDS", "materiality"]
