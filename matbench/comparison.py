"""A whole comparison: choose methods and scenes, run, score, report. Where the parts are put together."""

import platform
import shlex
import sys
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

from attrs import frozen

from matbench import plugins, run, scoring
from matbench._version import __version__
from matbench.dataset import Listing
from matbench.errors import UserError
from matbench.plan import Plan, make_plan, methods
from matbench.scene import Scene
from matbench.scenes import data_root, listings, load_scene, select
from matbench.store import Store, write_text

if TYPE_CHECKING:
    import pandas as pd

PAPER_SCENES = ("middlebury2001/tsukuba", "middlebury2006/Rocks1", "middlebury2003/teddy")
RUNS = Path("runs")


@frozen(eq=False)
class Comparison:
    """A plan with its scenes in memory and its folder on disk, ready to run or to look at.

    Parameters
    ----------
    scenes
        Name -> scene, whole, for every scene of the plan.
    record
        Write a recording of every cell.
    command
        The line that asked for it, for the report.
    """

    plan: Plan
    store: Store
    scenes: Mapping[str, Scene]
    data: Path | None
    record: bool
    command: str

    @property
    def folder(self) -> Path:
        return self.store.folder

    def run(self, listen: run.Listener | None = None) -> None:
        """Compute what is not done yet."""
        names = {cell.method.algorithm for cell in self.plan.cells}
        found = plugins.algorithms([Path(file) for file in self.plan.plugin_files])
        entries = [found[name].entry for name in sorted(names)]
        preload = [entry.module for entry in entries if not isinstance(entry, type)]
        run.run(self.plan, self.store, data=self.data, record=self.record, preload=preload, listen=listen)

    def tables(self) -> "tuple[pd.DataFrame, pd.DataFrame]":
        """Score the stored maps; write and return ``results.csv`` and ``cells.csv``."""
        results = scoring.results(self.plan, self.store, self.scenes)
        cells = scoring.cells(self.plan, self.store)
        write_text(self.folder / "results.csv", results.to_csv(index=False))
        write_text(self.folder / "cells.csv", cells.to_csv(index=False))
        return results, cells

    def report(self, results: "pd.DataFrame", cells: "pd.DataFrame") -> Path:
        """Write ``report.html``."""
        from matbench.reports import page

        stored = {(c.method.algorithm, c.method.changed, c.scene, c.seed): c for c in self.plan.cells}
        path = self.folder / "report.html"

        def disparity(algorithm: str, params: str, scene: str, seed: int):  # type: ignore[no-untyped-def]
            cell = stored[algorithm, params, scene, seed]
            outcome = self.store.outcome(cell)
            if outcome is None or outcome.status != "ok":
                return None
            return self.store.disparity(cell)[self.scenes[scene].ref]

        page.write(
            path,
            page.Report(
                title=f"matbench: {self.folder.name}",
                command=self.command,
                results=results,
                cells=cells,
                maps=disparity,
                scenes=self.scenes,
                facts=machine(),
                higher=frozenset(m.name for m in scoring.metrics() if m.better == "higher"),
            ),
        )
        return path


def machine() -> dict[str, str]:
    """What a run ran on: versions, processor, threads."""
    libraries = ("numpy", "numba", "opencv-python-headless", "scipy", "rerun-sdk")
    return {
        "matbench": __version__,
        "python": platform.python_version(),
        **{name: version(name) for name in libraries},
        "system": f"{platform.system()} {platform.machine()}",
        "processor": _processor(),
        "threads": str(run.threads()),
    }


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or "unknown"
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), "unknown")


def default_algorithms() -> list[str]:
    """All built-in methods."""
    return [p.name for p in plugins.installed("algorithms").values() if p.source == "matbench-stereo"]


def default_scenes(data: str | Path | None = None) -> tuple[list[str], list[str]]:
    """The built-in synthetic scenes and the paper's three: those that are present, and those missing."""
    known = listings(data)
    present = {name for name, listing in known.items() if isinstance(listing, Listing) and listing.present}
    synthetic = [name for name in known if name.startswith("synthetic/") and name in present]
    paper = [name for name in PAPER_SCENES if name in present]
    return synthetic + paper, [name for name in PAPER_SCENES if name not in present]


def prepare(
    algorithms: str | Sequence[str] | None = None,
    scenes: str | Sequence[str] | None = None,
    *,
    data: str | Path | None = None,
    out: str | Path | None = None,
    record: bool = False,
    seed: int | Sequence[int] = 0,
    plugin: Sequence[str | Path] = (),
    command: str | None = None,
) -> Comparison:
    """Check everything that was asked for, read every scene, and only then write the plan.

    Parameters are those of `compare`.
    """
    files = [Path(file).resolve() for file in plugin]
    seeds = [seed] if isinstance(seed, int) else list(dict.fromkeys(seed))
    if not seeds or min(seeds) < 0:
        raise UserError(f"seed {seeds or 'none'}: give whole numbers from 0")
    own = [p.name for file in files for p in plugins.from_file(file).values()]
    chosen = methods(algorithms if algorithms is not None else [*default_algorithms(), *own], files)
    root = data_root(data)
    names = select(scenes, root) if scenes is not None else default_scenes(root)[0]
    if not chosen or not names:
        raise UserError("nothing to compare: name at least one algorithm and one scene")
    loaded = {}
    for name in names:
        scene = load_scene(name, root)
        loaded[scene.name] = scene
    plan = make_plan(chosen, loaded, seeds, files)
    folder = Path(out) if out is not None else RUNS / plan.digest
    store = Store.open(folder, plan)
    said = command if command is not None else shlex.join(["matbench", *sys.argv[1:]])
    return Comparison(plan, store, loaded, root, record, said)


def compare(
    algorithms: str | Sequence[str] | None = None,
    scenes: str | Sequence[str] | None = None,
    *,
    data: str | Path | None = None,
    out: str | Path | None = None,
    record: bool = False,
    seed: int | Sequence[int] = 0,
    plugin: Sequence[str | Path] = (),
) -> "pd.DataFrame":
    """Run methods on scenes and score them; the run folder stays for `matbench view` and the report.

    Parameters
    ----------
    algorithms
        Selectors such as ``"sgbm"`` or ``"materiality[pairs=all,consecutive]"``; all built-in
        methods, and those of `plugin`, if not given.
    scenes
        Selectors such as ``"synthetic/*"`` or ``"middlebury2003/teddy[views=0:9:2]"``; the
        synthetic scenes and the paper's three where they are present, if not given.
    data
        The folder of real scenes; without it the one that MATBENCH_DATA names.
    out
        The run folder; ``runs/<digest of the request>`` if not given. A folder that holds the
        same request is resumed.
    record
        Also write a rerun recording of every cell, from a second, untimed solve.
    seed
        One seed or several.
    plugin
        Python files that hold further methods.

    Returns
    -------
    DataFrame
        ``results.csv``: one row for each method, scene, seed, region and metric.

    Raises
    ------
    UserError
        For anything asked for that cannot be; nothing is written then.
    """
    comparison = prepare(
        algorithms,
        scenes,
        data=data,
        out=out,
        record=record,
        seed=seed,
        plugin=plugin,
        command="matbench.compare(...)",
    )
    comparison.run()
    results, cells = comparison.tables()
    comparison.report(results, cells)
    return results
