"""Everything that the report page shows, as one frozen value."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import pandas as pd
from attrs import field, frozen
from numpy.typing import NDArray

from matbench.measures.metrics import Better
from matbench.measures.volumes import StoredVolume
from matbench.reports.published import Beside
from matbench.reports.tables import METRIC, THRESHOLD
from matbench.results.sweeps import Sweep
from matbench.scene import Scene
from matbench.typed import Value

Key = tuple[str, str, str, int]
"""Algorithm, parameters, scene and seed: they name a cell."""

Maps = Mapping[Key, NDArray[np.float32] | None] | Callable[[str, str, str, int], NDArray[np.float32] | None]

Volumes = Callable[[str, str, str, int], StoredVolume | None]
History = Mapping[str, Sequence[float | None]]


def _no_volume(*_: object) -> None:
    return None


@frozen(eq=False)
class Report:
    """A finished run, with everything that its page shows.

    Parameters
    ----------
    title
        What the run is called.
    command
        The command line that made it.
    results
        Tidy scores: algorithm, params, scene, view, seed, region, metric, value, unit, pixels.
    cells
        One row a cell: algorithm, params, scene, seed, status, seconds, peak_mb, reason.
    maps
        Cell -> (H, W) disparity of the reference view, pixels per view step, NaN = no answer; None
        where there is none. A function of the four names, so that maps are read one at a time, or
        a mapping.
    scenes
        Name -> scene. A scene that is not among them has no pictures.
    facts
        What the run ran on, as it is shown: ``{"numpy": "2.4.1", "processor": ...}``.
    ablation
        What each factor does (`matbench.results.ablation.COLUMNS`), if that was asked for.
    sweeps
        The curves of options that took several numbers.
    reliability
        Reliability curves of the volumes that were kept (`matbench.results.scores.reliabilities`).
    sparsification
        Curves of risk over coverage of the confidence maps (`matbench.results.scores.Tables`).
    better
        Metric -> which direction is better; of all others, less is.
    volumes
        Cell -> the volume that was kept, or None; read one at a time.
    histories
        Cell -> name -> one number for each pass, such as energies; None for a number that is not finite.
    parameters
        Method, as `cells` names it by algorithm and params -> every parameter with its value.
    groups
        Algorithm -> parameter -> the group that it is shown in, where it has one.
    rows
        The image rows of the epipolar slices; empty if none were asked for.
    beside
        Scores as published, beside the measured ones, if that was asked for.
    metric
        What methods are ranked by until a reader chooses another one.
    decision
        How a run ended that grew until a difference was decided; empty for others.
    """

    title: str
    command: str
    results: pd.DataFrame
    cells: pd.DataFrame
    maps: Maps = field(factory=dict)
    scenes: Mapping[str, Scene] = field(factory=dict)
    facts: Mapping[str, str] = field(factory=dict)
    ablation: pd.DataFrame | None = None
    sweeps: tuple[Sweep, ...] = ()
    reliability: pd.DataFrame | None = None
    sparsification: pd.DataFrame | None = None
    better: Mapping[str, Better] = field(factory=dict)
    volumes: Volumes = _no_volume
    histories: Mapping[Key, History] = field(factory=dict)
    parameters: Mapping[tuple[str, str], Mapping[str, Value]] = field(factory=dict)
    groups: Mapping[str, Mapping[str, str]] = field(factory=dict)
    rows: Sequence[int] = ()
    beside: Beside | None = None
    decision: str = ""
    metric: str = METRIC

    @property
    def wrong(self) -> float:
        """Px of the pair: an answer with a larger error is wrong in the figures. The threshold in `metric`, or 1."""
        found = THRESHOLD.fullmatch(self.metric)
        return float(found[2]) if found else 1.0

    def disparity(self, algorithm: str, params: str, scene: str, seed: int) -> NDArray[np.float32] | None:
        """(H, W) disparity map of a cell, or None; also None where its size is not the scene's."""
        if isinstance(self.maps, Mapping):
            found = self.maps.get((algorithm, params, scene, seed))
        else:
            found = self.maps(algorithm, params, scene, seed)
        known = self.scenes.get(scene)
        if found is None or known is None or found.shape != (known.height, known.width):
            return None
        return found
