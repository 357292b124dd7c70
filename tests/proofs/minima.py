"""Does the energy of the paper prefer the truth?

    python tests/proofs/minima.py measure ENERGIES.csv -s 'synthetic/world[seed=0 n=5 size=120x90]'
    python tests/proofs/minima.py table ENERGIES.csv

For each form of the energy (`SETTINGS`), its terms are taken at several maps: the truth, the answer of the default, and
where the descent ends, once from its start and once from the truth. If the descent from the truth leaves it, and ends
no higher than the other, then it is the energy that prefers a wrong answer, and no better optimiser helps. Energies
are per pixel, less the sum of rho^2. Beside them: the wrong pixels of the map read from mu alone, ray by ray; of the
default those of its own map. All is without `surfaces`.

Computed scenes have exact materialities. Of real ones only some views have truth: there the truth and the default are
those views' surfaces, and what no such view sees is empty in both.
"""

import argparse
import csv
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from attrs import evolve
from numpy.typing import NDArray

from matbench.algorithms.materiality import Materiality
from matbench.algorithms.materiality.binarize import by_ray, seen_rays
from matbench.algorithms.materiality.consensus import consensus
from matbench.algorithms.materiality.descent import Descent
from matbench.algorithms.similarity import Matcher
from matbench.datasets.synthetic import materiality
from matbench.measures.metrics import score
from matbench.measures.statistics import paired_effect
from matbench.results.metric_catalogue import metric_named
from matbench.scene import Scene
from matbench.scenes.catalogue import load_scene
from matbench.space import DisparitySpace, surface
from matbench.spec import parse

SETTINGS: Mapping[str, Mapping[str, object]] = {
    "squares": {},
    "linear": {"form": "linear"},
    "linear, tied more": {"form": "linear", "across": 20.0, "along": 20.0},
}
TRUTH, DEFAULT, FOUND, LEFT = "truth", "default", "found", "from truth"
TERMS = ("total", "data", "adjacent", "count")
REGIONS = ("nonocc", "all", "occ")
METRIC = "total_bad_1"
COLUMNS = ["scene", "form", "map", *TERMS, *REGIONS]

Floats = NDArray[np.float32]


def solid(space: DisparitySpace, maps: Mapping[int, Floats]) -> Floats:
    """Materialities of maps of some views, in pixels per view step; between two pixels the nearer one is asked."""
    near = np.rint(np.arange(space.samples) / space.fineness).astype(int)
    fine = {view: found[:, near].astype(np.float32) for view, found in maps.items()}
    return surface(space, fine, tuple(range(space.views))).values


def truth_of(scene: Scene, matcher: Matcher, name: str) -> tuple[Floats, Mapping[int, NDArray[np.bool_]]]:
    """The true materialities, and of which pixels of which views they are the surfaces."""
    space, seen = matcher.space, matcher.scene.truth
    (spec,) = parse(name)
    if spec.name.startswith("synthetic/"):
        exact = materiality(spec.name.removeprefix("synthetic/"), spec.options, space.fineness).values
        whole = np.ones((space.rows, space.width), bool)
        return exact, dict.fromkeys(range(space.views), whole)
    return solid(space, seen), {view: np.isfinite(found) for view, found in seen.items()}


def rows_of(name: str, passes: int, scene: Scene | None = None) -> Iterator[tuple[object, ...]]:
    """Rows of `COLUMNS`."""
    scene = load_scene(name) if scene is None else scene
    plain = Materiality(**Materiality.presets["descent"], views=5, surfaces=False)  # type: ignore[arg-type]
    matcher = Matcher.of(scene, plain.matching)
    space, rho, inference = matcher.space, matcher.all(), plain.inference
    first = inference.initial_maps(matcher)
    default, *_ = inference.refined_maps(matcher, first, plain.solver.material)
    truth, known = truth_of(scene, matcher, name)
    steps = (default + np.float32(space.first)) / np.float32(space.fineness)
    answer = solid(space, {view: np.where(mask, steps[view], np.nan) for view, mask in known.items()})
    start, metric = consensus(space, first), metric_named(METRIC)
    for form, options in SETTINGS.items():
        energy = evolve(plain, **options)._energy(matcher, rho, 1)
        descent = Descent(passes, True, energy.safe_step)
        ends = {FOUND: start, LEFT: truth}
        maps = {TRUTH: truth, DEFAULT: answer} | {end: descent.run(energy, of.copy())[0] for end, of in ends.items()}
        nothing = energy.step(np.zeros_like(truth), truth, 0.0, 0.0, np.empty_like(truth), None, 1)["data"]
        for label, mu in maps.items():
            found = energy.step(mu, mu, 0.0, 0.0, np.empty_like(mu), None, 1)
            terms = {term: found[term] - (nothing if term in ("total", "data") else 0) for term in TERMS}
            per_pixel = [terms[term] / (space.rows * space.samples) for term in TERMS]
            rays = by_ray(seen_rays(mu, space, matcher.scene.ref))
            read = matcher.disparity(default[matcher.scene.ref] if label == DEFAULT else rays)
            bad = [
                score(read, scene.truth[scene.ref], scene.regions[region], scene.pair_steps, [metric], scene)[METRIC]
                for region in REGIONS
            ]
            yield name, form, label, *per_pixel, *bad


def measure(path: Path, scenes: Sequence[str], passes: int) -> None:
    """Append the rows that are missing."""
    done = set(pd.read_csv(path, names=COLUMNS)["scene"]) if path.exists() else set()
    for number, name in enumerate(scenes, 1):
        if name not in done:
            rows = list(rows_of(name, passes))
            with path.open("a", newline="") as file:
                csv.writer(file).writerows(rows)
        print(f"{number} of {len(scenes)}: {name}", file=sys.stderr)


def table(found: pd.DataFrame) -> Iterator[str]:
    """Means over the scenes, and E(truth) - E(found) with its interval."""
    heads = ["form", "map", *TERMS, *REGIONS]
    yield "| " + " | ".join(heads) + " |\n" + "|---" * len(heads) + "|"
    for form in SETTINGS:
        rows = found[found["form"] == form]
        for label in (TRUTH, DEFAULT, FOUND, LEFT):
            means = rows[rows["map"] == label][[*TERMS, *REGIONS]].mean()
            shown = [f"{means[term]:.3f}" for term in TERMS] + [f"{means[region]:.2f}" for region in REGIONS]
            yield f"| {form} | {label} | " + " | ".join(shown) + " |"
    for form in SETTINGS:
        wide = {
            term: found[found["form"] == form].pivot(index="scene", columns="map", values=term)
            for term in (*TERMS, "all")
        }
        for one, other in ((TRUTH, FOUND), (TRUTH, DEFAULT), (LEFT, FOUND)):
            effects = {term: paired_effect((values[one] - values[other]).to_list()) for term, values in wide.items()}
            said = (f"{term} {e.mean:+.3f} ({e.low:+.3f} .. {e.high:+.3f})" for term, e in effects.items())
            yield f"{form}: {one} - {other}: " + "; ".join(said)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("measure")
    one.add_argument("energies", type=Path)
    one.add_argument("-s", "--scene", action="append", required=True)
    one.add_argument("--passes", type=int, default=100)
    commands.add_parser("table").add_argument("energies", type=Path)
    given = parser.parse_args(arguments)
    if given.command == "measure":
        measure(given.energies, given.scene, given.passes)
    else:
        print("\n".join(table(pd.read_csv(given.energies, names=COLUMNS))))


if __name__ == "__main__":
    main()
