"""Page, terminal, LaTeX, curves and switches print one interval for one pair of methods, digit by digit."""

import numpy as np
import pandas as pd

from matbench.plans.plan import Cell, Method, Plan
from matbench.reports import curves, switches, tables
from matbench.reports.content import Report
from matbench.reports.numbers import Numbers
from matbench.reports.standing import turned
from matbench.results.ablation import ablation
from matbench.results.sweeps import sweeps
from matbench.spec import read_scene

BASE, *LEVELS = (3, 5, 7)
# as they were asked for, which is not in the order of the alphabet; one of them in two guises
SCENES = [f"d/{name}" for name in ("zebra", "ant", "mole", "bee", "yak", "cow[noise=4]", "cow[noise=8]", "dog", "elk")]


def run() -> tuple[Plan, pd.DataFrame, pd.DataFrame]:
    methods = [Method("m", {"window": w}, f"window={w}" if w != BASE else "") for w in (BASE, *LEVELS)]
    plan = Plan(tuple(Cell(m, scene, "", seed, "") for m in methods for scene in SCENES for seed in (0, 1)))
    random = np.random.default_rng(5)
    rows = [
        (c.method.algorithm, c.method.changed, c.scene, "0", c.seed, "all", "total_bad_1", random.normal(), "%", 900)
        for c in plan.cells
    ]
    heads = ["algorithm", "params", "scene", "view", "seed", "region", "metric", "value", "unit", "pixels"]
    results = pd.DataFrame(rows, columns=heads)
    costs = [(c.method.algorithm, c.method.changed, c.scene, c.seed, "ok", 1.0, "") for c in plan.cells]
    cells = pd.DataFrame(costs, columns=["algorithm", "params", "scene", "seed", "status", "seconds", "reason"])
    return plan, results, cells


def test_every_interval_of_a_pair_is_the_same_number() -> None:
    plan, results, cells = run()
    found = ablation(plan, results)
    labelled = [tables.labelled(frame) for frame in (results, cells)]
    numbers = Numbers(Report("r", "c", *labelled), tables.shared(*labelled))
    pairs = {(d.method, d.reference): d.effect for d in numbers.differences["total_bad_1"]["all"]}
    shown = switches.lines(found)
    assert len({read_scene(scene).name for scene in SCENES}) == 8
    for level, (_, row), (_, line) in zip(LEVELS, found.iterrows(), shown.iterrows(), strict=True):
        effect = pairs[f"m[window={level}]", "m"]
        assert (effect.mean, effect.scenes) == (row["change"], 8)
        assert (effect.low, effect.high, effect.size) == (row["low"], row["high"], row["effect_size"])
        (told,) = (one for one in numbers.against("total_bad_1", "all", "m") if one["method"] == f"m[window={level}]")
        assert [told[k] for k in ("mean", "interval", "size", "verdict")][:3] == [
            line[k] for k in ("change", "interval", "size")
        ]
        assert line["interval"].replace("-", "$-$") in switches.latex(found)
        # the other way round it is its negative, for the script, too
        back = turned(effect)
        (told,) = (one for one in numbers.against("total_bad_1", "all", f"m[window={level}]") if one["method"] == "m")
        assert told["interval"] == tables.interval(back.low, back.high)
        (given,) = (
            d for d in numbers.data()["differences"]["total_bad_1"]["all"] if d[:2] == [LEVELS.index(level) + 1, 0]
        )
        assert given[7:9] == [tables.text(v, "%", signed=True) for v in (effect.low, effect.high)]


def test_a_curve_over_the_same_scenes_has_the_interval_of_the_pair() -> None:
    plan, results, _ = run()
    keep = ~results["scene"].str.contains("noise=8")
    some = Plan(tuple(cell for cell in plan.cells if "noise=8" not in cell.scene))
    found = ablation(some, results[keep])
    (sweep,) = sweeps(some, results[keep])
    last = sweep.curves.iloc[-1]
    assert (last["change"], last["change_low"], last["change_high"]) == tuple(found.loc[1, ["change", "low", "high"]])
    assert curves.lines(sweep)["interval"].iloc[-1] == switches.lines(found)["interval"].iloc[-1]
