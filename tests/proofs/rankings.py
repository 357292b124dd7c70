"""Do computed scenes rank methods as real ones do?

    python tests/proofs/rankings.py measure SCORES.csv -s worlds/standard        scores of all methods, scene by scene
    python tests/proofs/rankings.py tau REAL.csv WORLDS.csv [...]                Kendall's tau between the rankings

`measure` solves in this process, one method after the other, and goes on where it was interrupted; ``--part k/n`` takes
every n-th scene. `tau` compares mean ``total_bad_1`` over scenes. Its interval is the 95 % percentile interval over
resamples of the scenes on both sides.
"""

import argparse
import csv
import re
import sys
import time
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.stats import kendalltau

from matbench.algorithm import Context
from matbench.measures.metrics import score
from matbench.measures.statistics import FEW, paired_effect
from matbench.plans.plugins import algorithm
from matbench.regions import counts
from matbench.results.metric_catalogue import metric_named
from matbench.scenes.catalogue import load_scene, select
from matbench.spec import expand

METHODS = (
    "materiality",
    "materiality[views=3]",
    "materiality[similarity=census]",
    "materiality[mending=0]",
    "multiview_sgm",
    "multiview_sgm[views=3]",
    "multiview_sgm[similarity=linear]",
    "multiview_sgm[views=2]",
    "okutomi_kanade",
    "okutomi_kanade[window=3]",
    "okutomi_kanade[window=13]",
    "okutomi_kanade[views=3]",
    "kang_szeliski",
    "guided_filter",
    "guided_filter[views=2]",
    "ssd",
    "ssd[window=9]",
    "ssd[selection=mean]",
    "ssd[views=2]",
    "scanline",
    "dynamic_programming",
    "dynamic_programming[similarity=shared]",
    "graph_cut",
    "voxel_coloring",
    "voxel_coloring[fill=true]",
    "space_carving",
    "collins_sweep",
    "collins_sweep[dense=true]",
    "sgbm",
    "sgbm[block_size=9]",
    "sgbm[fill=false]",
    "kang_szeliski[similarity=shared]",
    "guided_filter[similarity=shared]",
    "ssd[similarity=shared]",
    "scanline[similarity=shared]",
    "graph_cut[similarity=shared]",
    "voxel_coloring[rule=chi_squared]",
    "niquin",
    "niquin[similarity=shared]",
    "kolmogorov_zabih",
    "kolmogorov_zabih[similarity=shared]",
)
"""All methods and further settings of them."""

REGIONS = ("nonocc", "all", "occ")
RESAMPLES = 2000


def measure(path: Path, scenes: Sequence[str], methods: Sequence[str], part: tuple[int, int]) -> None:
    """Append the scores that are missing: method, scene, region, value, pixels, known, seconds."""
    done = set()
    if path.exists():
        with path.open() as file:
            done = {(row[0], row[1]) for row in csv.reader(file)}
    metric = metric_named("total_bad_1")
    names = select(scenes).names[part[0] :: part[1]]
    for number, name in enumerate(names):
        scene = None
        for method in methods:
            if (method, name) in done:
                continue
            scene = load_scene(name) if scene is None else scene
            (asked,) = expand(method)
            made = algorithm(asked.name).make(asked.options)
            began = time.process_time()
            found = made.solve(scene, Context(volume=False)).disparity[scene.ref]
            seconds = time.process_time() - began
            truth = scene.truth[scene.ref]
            known = int(scene.regions["all"].sum())
            with path.open("a", newline="") as file:
                for region in REGIONS:
                    mask = scene.regions[region]
                    value = score(found, truth, mask, scene.pair_steps, [metric], scene)["total_bad_1"]
                    csv.writer(file).writerow([method, name, region, value, int(mask.sum()), known, round(seconds, 3)])
        print(f"{number + 1} of {len(names)}: {name}", file=sys.stderr)


def read(path: Path) -> pd.DataFrame:
    """Scores of the regions that count."""
    table = pd.read_csv(path, header=None, names=["method", "scene", "region", "value", "pixels", "known", "seconds"])
    kept = [counts(int(pixels), int(known)) for pixels, known in zip(table["pixels"], table["known"], strict=True)]
    return table[kept]


def square(table: pd.DataFrame, region: str) -> pd.DataFrame:
    """Scenes x methods, of the methods that have a value for every scene that most methods have a value for."""
    wide = table[table["region"] == region].pivot(index="scene", columns="method", values="value")
    return wide[wide.notna().mean(axis=1) > 0.5].dropna(axis="columns")


def _in_order(names: Iterable[str]) -> list[int]:
    """Places of the scenes by their numbers: worlds are taken seed by seed."""
    numbers = [[int(found) for found in re.findall(r"\d+", name)] for name in names]
    return sorted(range(len(numbers)), key=lambda k: numbers[k])


def tau(real: pd.DataFrame, other: pd.DataFrame, seed: int = 0) -> tuple[float, float, float]:
    """Kendall's tau-b between the means of the methods that both have, and its interval.

    Parameters
    ----------
    real, other
        Scenes x methods.
    """
    both = [method for method in real.columns if method in set(other.columns)]
    a, b = real[both].to_numpy(float), other[both].to_numpy(float)
    drawn = np.random.default_rng(seed)
    means = [
        (a[drawn.integers(0, len(a), len(a))].mean(0), b[drawn.integers(0, len(b), len(b))].mean(0))
        for _ in range(RESAMPLES)
    ]
    low, high = np.quantile([kendalltau(one, two).statistic for one, two in means], (0.025, 0.975))
    return float(kendalltau(a.mean(0), b.mean(0)).statistic), float(low), float(high)


def halves(real: pd.DataFrame, seed: int = 0) -> float:
    """Mean tau between two halves of the scenes: what real scenes agree in among themselves."""
    drawn, values, found = np.random.default_rng(seed), real.to_numpy(float), []
    for _ in range(300):
        order = drawn.permutation(len(values))
        first, second = order[: len(order) // 2], order[len(order) // 2 :]
        found.append(kendalltau(values[first].mean(0), values[second].mean(0)).statistic)
    return float(np.mean(found))


def decided(scores: pd.DataFrame, method: str, control: str) -> tuple[str, int | None]:
    """The difference of two methods with its interval, and from how many scenes on, in order, it was decided.

    Parameters
    ----------
    scores
        Scenes x methods, in the order in which they are taken.
    """
    differences = (scores[method] - scores[control]).to_list()
    whole = paired_effect(differences)
    count = None
    for taken in range(len(differences), FEW - 1, -1):
        effect = paired_effect(differences[:taken])
        if effect.low <= 0 <= effect.high:
            break
        count = taken
    return f"{whole.mean:+.2f} ({whole.low:+.2f} .. {whole.high:+.2f}) over {len(differences)}", count


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("measure")
    one.add_argument("scores", type=Path)
    one.add_argument("-s", "--scene", action="append", required=True)
    one.add_argument("-a", "--algorithm", action="append")
    one.add_argument("--part", default="0/1", help="k/n: every n-th scene, from the k-th on")
    two = commands.add_parser("tau")
    two.add_argument("real", type=Path)
    two.add_argument("others", type=Path, nargs="+")
    two.add_argument("--decide", nargs=2, default=("materiality", "multiview_sgm"), help="a method and its control")
    two.add_argument("--apart", action="store_true", help="name the methods that are ranked most differently")
    given = parser.parse_args(arguments)
    if given.command == "measure":
        k, n = map(int, given.part.split("/"))
        measure(given.scores, given.scene, given.algorithm or METHODS, (k, n))
        return
    real = read(given.real)
    for region in REGIONS:
        mine = square(real, region)
        print(f"{region}: real scenes {len(mine)}, methods {len(mine.columns)}, halves agree {halves(mine):.2f}")
        if set(given.decide) <= set(mine):
            print(f"  {' - '.join(given.decide)}: {decided(mine, *given.decide)}")
        for path in given.others:
            other = square(read(path), region)
            best, low, high = tau(mine, other)
            common = len(set(mine) & set(other))
            print(f"  {path.stem:14} {best:.2f} ({low:.2f} .. {high:.2f}) over {len(other)} scenes, {common} methods")
            if set(given.decide) <= set(other):
                print(f"  {'':14} {decided(other.iloc[_in_order(other.index)], *given.decide)}")
            if given.apart:
                both = [method for method in mine.columns if method in set(other.columns)]
                ranks = pd.DataFrame({"real": mine[both].mean().rank(), "other": other[both].mean().rank()})
                ranks["real %"], ranks["other %"] = mine[both].mean(), other[both].mean()
                ranks["apart"] = ranks["other"] - ranks["real"]
                print(ranks.sort_values("real").round(1).to_string())


if __name__ == "__main__":
    main()
