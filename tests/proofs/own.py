"""What is materiality's own: V alone, mu alone, both, neither, by the number of views that see a point.

    python tests/proofs/own.py measure SCORES.csv -s worlds/standard      scores of the four, scene by scene
    python tests/proofs/own.py table SCORES.csv                           means, and differences with intervals

`measure` solves in this process and goes on where it was interrupted; ``--part k/n`` takes every n-th scene. How many
views see a point is exact on computed scenes; on real ones it follows from the truth (`matbench.regions.seen_by`). A
scene counts in a region where that is large enough for its means (`matbench.regions.counts`).
"""

import argparse
import csv
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import pandas as pd

from matbench.algorithm import Context
from matbench.algorithms.materiality import Materiality
from matbench.measures.metrics import score
from matbench.measures.statistics import Effect, paired_effect
from matbench.regions import Mask, counts, seen_by
from matbench.results.metric_catalogue import metric_named
from matbench.scene import Scene
from matbench.scenes.catalogue import load_scene, select

NEITHER, MU, V, BOTH = "neither", "mu", "V", "both"
EQUAL: Mapping[str, object] = {"surfaces": False}  # a pass takes the surfaces of the first maps over by mu alone
SWITCHES: Mapping[str, Mapping[str, object]] = {
    NEITHER: {"visibility": False, "material": 0.0},
    MU: {"visibility": False},
    V: {"material": 0.0},
    BOTH: {},
}
CHANGES = ((MU, NEITHER), (V, NEITHER), (BOTH, NEITHER), (BOTH, V), (BOTH, MU))
METRIC = "total_bad_1"
COLUMNS = ["method", "scene", "region", "value", "pixels", "known"]


def masks_of(scene: Scene) -> Mapping[str, Mask]:
    """The field's regions, and those by the number of views that see a point."""
    seen = seen_by(scene.truth[scene.ref], scene.ref, scene.n, scene.visible.get(scene.ref), scene.places)
    return {**{region: scene.regions[region] for region in ("nonocc", "all", "occ")}, **seen}


def scores(scene: Scene, name: str, methods: Sequence[str] = tuple(SWITCHES)) -> Iterator[tuple[object, ...]]:
    """Rows of `COLUMNS`."""
    metric, masks = metric_named(METRIC), masks_of(scene)
    known = int(masks["all"].sum())
    for method in methods:
        found = Materiality(**EQUAL, **SWITCHES[method]).solve(scene, Context(volume=False)).disparity[scene.ref]  # type: ignore[arg-type]
        for region, mask in masks.items():
            value = score(found, scene.truth[scene.ref], mask, scene.pair_steps, [metric], scene)[METRIC]
            yield method, name, region, value, int(mask.sum()), known


def measure(path: Path, scenes: Sequence[str], part: tuple[int, int]) -> None:
    """Append the scores that are missing."""
    done = set(pd.read_csv(path, names=COLUMNS)["scene"]) if path.exists() else set()
    names = select(scenes).names[part[0] :: part[1]]
    for number, name in enumerate(names, 1):
        if name not in done:
            rows = list(scores(load_scene(name), name))
            with path.open("a", newline="") as file:
                csv.writer(file).writerows(rows)
        print(f"{number} of {len(names)}: {name}", file=sys.stderr)


def table(found: pd.DataFrame) -> Iterator[tuple[str, int, Mapping[str, float], Mapping[tuple[str, str], Effect]]]:
    """Region, number of scenes, mean of each method, and the changes from one to another."""
    kept = [counts(int(pixels), int(known)) for pixels, known in zip(found["pixels"], found["known"], strict=True)]
    for region, rows in found[kept].groupby("region", sort=False):
        wide = rows.pivot(index="scene", columns="method", values="value")
        means = {method: float(wide[method].mean()) for method in SWITCHES}
        changes = {(to, of): paired_effect((wide[to] - wide[of]).to_list()) for to, of in CHANGES}
        yield str(region), len(wide), means, changes


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("measure")
    one.add_argument("scores", type=Path)
    one.add_argument("-s", "--scene", action="append", required=True)
    one.add_argument("--part", default="0/1", help="k/n: every n-th scene, from the k-th on")
    commands.add_parser("table").add_argument("scores", type=Path)
    given = parser.parse_args(arguments)
    if given.command == "measure":
        k, n = map(int, given.part.split("/"))
        measure(given.scores, given.scene, (k, n))
        return
    print(
        "| region | scenes | " + " | ".join(SWITCHES) + " | " + " | ".join(f"{to} - {of}" for to, of in CHANGES) + " |"
    )
    print("|---" * (2 + len(SWITCHES) + len(CHANGES)) + "|")
    for region, scenes, means, changes in table(pd.read_csv(given.scores, names=COLUMNS)):
        shown = [f"{mean:.2f}" for mean in means.values()]
        shown += [f"{effect.mean:+.2f} ({effect.low:+.2f} .. {effect.high:+.2f})" for effect in changes.values()]
        print(f"| {region} | {scenes} | " + " | ".join(shown) + " |")


if __name__ == "__main__":
    main()
