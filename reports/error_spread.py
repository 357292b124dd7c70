"""How errors are distributed: over thresholds, and over the number of views that see a pixel."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from matbench.measures.metrics import TIE, error_map
from matbench.regions import points_seen
from matbench.reports import page_figures
from matbench.reports.tables import REGIONS, Shared
from matbench.scene import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

THRESHOLDS = np.arange(0, 8.01, 0.25)
"""Times the error above which an answer is wrong (`Report.wrong`)."""

LEAST_PIXELS = 50  # a share of fewer pixels is mostly chance

Counts = NDArray[np.intp]


def views_seeing(scene: Scene) -> Counts | None:
    """(H, W) how many views see each point of the reference view, itself included; 0 where truth is unknown.

    Exact where the scene knows it, else from the truth, as for the regions over all views.
    """
    truth = scene.truth.get(scene.ref)
    if truth is None:
        return None
    exact = scene.visible.get(scene.ref)
    others = [view for view in range(scene.n) if view != scene.ref]
    seen = [points_seen(truth, scene.steps(view)) if exact is None else exact[view] for view in others]
    count: Counts = np.where(np.isfinite(truth), 1 + np.sum(seen, axis=0), 0)
    return count


@frozen(eq=False)
class Spread:
    """The errors of one map on one scene, by threshold and by number of views.

    Parameters
    ----------
    above
        Region -> (thresholds,) per cent of its pixels without an answer or with an error above each threshold.
    by_views
        Number of views that see a pixel -> per cent of these pixels without an answer or with an error above `wrong`.
    views
        How many views the scene has.
    wrong
        Px of the pair above which an error makes an answer wrong.
    """

    above: Mapping[str, NDArray[np.float64]]
    by_views: Mapping[int, float]
    views: int
    wrong: float = 1.0


def spread(estimate: NDArray[np.float32], scene: Scene, seeing: Counts, wrong: float = 1.0) -> Spread:
    """Measure one map of the reference view, (H, W) in pixels per view step.

    Parameters
    ----------
    seeing
        The result of `views_seeing`.
    wrong
        Px of the pair above which an error makes an answer wrong; thresholds are multiples of it.
    """
    truth = scene.truth[scene.ref]
    error = np.nan_to_num(error_map(estimate, truth, scene.pair_steps), nan=np.inf)
    known, above = np.isfinite(truth), {}
    for region, mask in scene.scored_regions.items():
        errors = np.sort(error[mask & known])
        if errors.size:
            above[region] = 100 * (1 - np.searchsorted(errors, THRESHOLDS * wrong + TIE, side="right") / errors.size)
    pixels = np.bincount(seeing[known], minlength=scene.n + 1)
    missed = np.bincount(seeing[known & (error > wrong + TIE)], minlength=scene.n + 1)
    by_views = {k: float(100 * missed[k] / pixels[k]) for k in range(1, scene.n + 1) if pixels[k] >= LEAST_PIXELS}
    return Spread(above, by_views, scene.n, wrong)


Spreads = Mapping[tuple[str, str], Spread]
"""Of each method on each scene."""


def thresholds(spreads: Spreads, scope: Shared) -> "Figure | None":
    """A panel for each region: per cent of pixels with errors above each threshold, a curve for each ranked method."""
    measured = {region for part in spreads.values() for region in part.above}
    found = [region for region in REGIONS if region in measured]
    methods = [m for m in scope.methods if scope.is_ranked(m)]
    panels = []
    for region in found:
        curves = {}
        for method in methods:
            here = [spreads[method, s] for s in scope.scenes if (method, s) in spreads]
            parts = [part.above[region] for part in here if region in part.above]
            if parts:
                curves[method] = (THRESHOLDS * here[0].wrong, np.mean(parts, axis=0))
        panels.append((region, curves))
    return page_figures.panels(panels, "threshold, px of the pair", "pixels above it, %", every=6)


def by_views(spreads: Spreads, scope: Shared) -> "tuple[Figure | None, list[str]]":
    """Wrong answers against how many views see a pixel, a panel for each number of views in a scene; and warnings."""
    methods = [m for m in scope.methods if scope.is_ranked(m)]
    shared = {s: part for (_, s), part in spreads.items() if s in scope.scenes}
    panels, said = [], []
    for count in sorted({part.views for part in shared.values()}):
        scenes = [s for s, part in shared.items() if part.views == count]
        places = sorted({k for s in scenes for k in shared[s].by_views})
        curves = {}
        for method in methods:
            means = [
                np.mean([spreads[method, s].by_views[k] for s in scenes if k in shared[s].by_views]) for k in places
            ]
            curves[method] = (np.array(places, float), np.array(means))
        panels.append((f"{count} views, {len(scenes)} scene{'s' if len(scenes) != 1 else ''}", curves))
        partly = [k for k in places if sum(k in shared[s].by_views for s in scenes) < len(scenes)]
        said += [f"{count} views: not every scene has pixels seen by {', '.join(map(str, partly))}."] if partly else []
    wrong = next((part.wrong for part in shared.values()), 1.0)
    return page_figures.panels(panels, "views that see the pixel", f"total_bad_{wrong:g}, %", backwards=True), said
