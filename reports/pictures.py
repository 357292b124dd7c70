"""The pictures of every scene on the page: encoded maps, slices, and the distribution of errors."""

import json
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pandas as pd
from attrs import frozen

from matbench.recording import coloring
from matbench.reports import error_spread, page_slices
from matbench.reports.content import Report
from matbench.reports.encoding import LEAST_SIDE, Coding, exact, photograph, side_for, size_within
from matbench.reports.tables import Shared
from matbench.scene import Scene
from matbench.shelf import facts_of

_BESIDES = 4  # pictures of a scene besides its methods': the truth, the view, slices

MOST = 13_000_000
"""The most characters that all pictures may take, so that the page stays below 15 MB."""


@frozen(eq=False)
class Gallery:
    """The pictures, scene by scene, for the page's template and, as JSON, for its script.

    Parameters
    ----------
    scenes
        For the template: one for each scene of `Shared.asked`, also those without images.
    codings
        For the script, one for each scene: how to read its maps, or None.
    slices
        For the script, one for each scene: rows, each with its slices.
    spreads
        The errors of each method on each scene.
    """

    scenes: list[dict[str, Any]]
    codings: list[dict[str, Any] | None]
    slices: list[list[dict[str, Any]]]
    spreads: error_spread.Spreads

    @property
    def characters(self) -> int:
        """About how many characters it takes on the page."""
        return len(json.dumps([self.scenes, self.slices]))


def gallery(report: Report, scope: Shared, most: int = MOST) -> Gallery:
    """All pictures of a run; the more there are, the smaller they are.

    Maps full of noise hardly compress. So if all take more than `most` characters, they are made again, smaller.
    """
    longest = max((max(known.size) for known in facts_of(report.scenes).values()), default=LEAST_SIDE)
    side = min(side_for((len(scope.methods) + _BESIDES) * len(scope.asked)), longest)
    found = _gallery(report, scope, side)
    while (taken := found.characters) > most and side > LEAST_SIDE:
        side = max(LEAST_SIDE, int(0.95 * side * (most / taken) ** 0.5))  # fewer pixels compress a little worse
        found = _gallery(report, scope, side)
    return found


def _gallery(report: Report, scope: Shared, side: int) -> Gallery:
    """The pictures with a longer side of at most `side` px. Every map and volume is read once."""
    out = Gallery([], [], [], {})
    spreads: dict[tuple[str, str], error_spread.Spread] = {}
    for name in scope.asked:
        cells = sorted(_first_seeds(report.cells, name), key=lambda c: scope.methods.index(c["method"]))
        scene = report.scenes.get(name)
        if scene is None:
            out.scenes.append({"name": name, "known": False})
            out.codings.append(None)
            out.slices.append([])
            continue
        coding, seeing = Coding.of(scene), error_spread.views_seeing(scene)

        def shown(
            cell: dict[str, Any], scene: Scene = scene, coding: Coding = coding, seeing: Any = seeing
        ) -> dict[str, Any]:
            return _map(report, scene, cell, coding, side, seeing)

        with ThreadPoolExecutor() as pool:  # the encoder releases the global interpreter lock
            maps = list(pool.map(shown, cells))
        for cell in maps:
            if (part := cell.pop("spread")) is not None:
                spreads[cell["method"], name] = part
        truth = scene.truth.get(scene.ref)
        low, high = coloring.disparity_ends(scene)
        out.scenes.append(
            {
                "name": name,
                "known": True,
                "views": scene.n,
                "ref": scene.labels[scene.ref],
                "size": (scene.width, scene.height),
                "shown": size_within(scene.height, scene.width, side)[::-1],
                "pair_steps": f"{scene.pair_steps:g}",
                "scale": [f"{v:.3g}" for v in (low, (low + high) / 2, high)],
                "view": photograph(scene.views[scene.ref], side),
                "truth": None if truth is None else coding.encode(truth, scene.pair_steps, side),
                "methods": maps,
            }
        )
        out.codings.append(
            {
                "low": coding.low,
                "step": coding.step,
                "gain": coding.gain,
                "pair": scene.pair_steps,
                "ends": [low * scene.pair_steps, high * scene.pair_steps],
                "size": [scene.width, scene.height],
            }
        )
        out.slices.append(_slices(report, scene, cells, side))
    return Gallery(out.scenes, out.codings, out.slices, spreads)


def _first_seeds(cells: pd.DataFrame, scene: str) -> list[dict[str, Any]]:
    """For each method on a scene, one cell: the first that is ok, else the first."""
    here = cells[cells["scene"] == scene].assign(bad=lambda c: c["status"] != "ok")
    first = here.sort_values("bad", kind="stable").drop_duplicates("method").sort_index()
    seeds = here.groupby("method").size()
    rows = [{str(k): v for k, v in row.items()} for row in first.to_dict("records")]
    return [{**row, "seeds": int(seeds[row["method"]])} for row in rows]


def _names(cell: dict[str, Any]) -> tuple[str, str, str, int]:
    return str(cell["algorithm"]), str(cell["params"]), str(cell["scene"]), int(cell["seed"])


def _map(
    report: Report, scene: Scene, cell: dict[str, Any], coding: Coding, side: int, seeing: error_spread.Counts | None
) -> dict[str, Any]:
    disparity = report.disparity(*_names(cell)) if cell["status"] == "ok" else None
    reason = cell.get("reason")
    out = {
        "method": cell["method"],
        "status": cell["status"],
        "reason": "" if reason is None or reason is pd.NA or reason != reason else str(reason),
        "seed": cell["seed"] if cell["seeds"] > 1 else None,
        "map": None,
        "spread": None,
    }
    if disparity is not None:
        disparity = disparity.astype(np.float32, copy=False)
        out["map"] = coding.encode(disparity, scene.pair_steps, side)
        out["spread"] = None if seeing is None else error_spread.spread(disparity, scene, seeing, report.wrong)
    return out


def _slices(report: Report, scene: Scene, cells: list[dict[str, Any]], side: int) -> list[dict[str, Any]]:
    """For each row the similarity of the views and, for every method with a volume, materiality and visibility."""
    rows = page_slices.rows_of(scene, report.rows)
    out: list[dict[str, Any]] = [
        {"row": row, "similarity": _picture(page_slices.similarity(scene, row), side), "methods": {}} for row in rows
    ]
    for cell in cells:
        volume = report.volumes(*_names(cell)) if cell["status"] == "ok" else None
        for row, part in zip(rows, out, strict=True):
            found = None if volume is None else page_slices.materiality(volume, scene, row)
            if found is not None:
                part["methods"][cell["method"]] = [_picture(one, side) for one in found]
    return out


def _picture(one: page_slices.PageSlice, side: int) -> dict[str, Any]:
    thin = one.values[:, :: -(-one.values.shape[1] // side)]
    return {"src": exact(np.ascontiguousarray(thin)), "ends": [round(end, 4) for end in one.ends]}
