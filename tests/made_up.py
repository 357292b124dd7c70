"""A small run, made up: two scenes, three methods with hostile names, a cell that failed."""

from itertools import product

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from matbench.reports.content import Key, Report
from matbench.scene import Range, Scene

HOSTILE = "<script>alert(1)</script>"
SCENES = ("made/one", f"made/{HOSTILE}")
METHODS = (("good", ""), (HOSTILE, "a=</script><!--"), ("broken", "x=[1] \"'&"))
REGIONS = ("all", "nonocc", "occ", "disc", "textureless", "mine")
METRICS = {"bad_1": "%", "total_bad_1": "%", "avg": "px", "weight": ""}


def scene(name: str) -> Scene:
    random = np.random.default_rng(0)
    truth = np.tile(np.linspace(1, 4, 24, dtype=np.float32), (16, 1))
    truth[:2] = np.nan
    views = random.integers(0, 255, (3, 16, 24, 3), dtype=np.uint8)
    return Scene(name, views, ("a", "b", "c"), 1, Range(0, 5), {1: truth}, 2.0, {"all": ~np.isnan(truth)})


def score(method: int, place: int, region: int, metric: int) -> float:
    return 10.0 * (method + 1) + place + region / 10 + metric / 100


def made_up() -> Report:
    """`broken` fails on the second scene; the hostile method's map on the first is all NaN."""
    scenes = {name: scene(name) for name in SCENES}
    cells: list[tuple[object, ...]] = []
    results: list[tuple[object, ...]] = []
    maps: dict[Key, NDArray[np.float32] | None] = {}
    for (m, (algorithm, params)), (s, name) in product(enumerate(METHODS), enumerate(SCENES)):
        if (m, s) == (2, 1):
            cells.append((algorithm, params, name, 0, "failed", None, None, f"ValueError: {HOSTILE}"))
            continue
        cells.append((algorithm, params, name, 0, "ok", 0.5 + m, 100.0 + m, ""))
        truth = scenes[name].truth[1]
        maps[algorithm, params, name, 0] = np.full_like(truth, np.nan) if (m, s) == (1, 0) else truth + np.float32(0.25)
        results += [
            (algorithm, params, name, "b", 0, region, metric, score(m, s, r, k), unit, 100)
            for r, region in enumerate(REGIONS)
            for k, (metric, unit) in enumerate(METRICS.items())
        ]
    return Report(
        title=f"a run {HOSTILE}",
        command=f"matbench compare -a '{HOSTILE}'",
        results=pd.DataFrame(
            results,
            columns=["algorithm", "params", "scene", "view", "seed", "region", "metric", "value", "unit", "pixels"],
        ),
        cells=pd.DataFrame(
            cells, columns=["algorithm", "params", "scene", "seed", "status", "seconds", "peak_mb", "reason"]
        ),
        maps=maps,
        scenes=scenes,
        facts={"numpy": "2", HOSTILE: HOSTILE},
    )
