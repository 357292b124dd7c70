"""A whole comparison: choose methods and scenes, run, score, report. Where the parts are put together."""

import operator
import platform
import shlex
import sys
import tomllib
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from matbench import plugins, run, scoring, spec
from matbench._version import __version__
from matbench.dataset import Listing
from matbench.errors import UserError, unknown
from matbench.plan import Plan, make_plan, methods
from matbench.scene import NotInScene, Scene
from matbench.scenes import PAPER_SCENES, Selection, data_root, is_pattern, listings, load_scene, select
from matbench.settings import Settings
from matbench.store import Store, write_text
from matbench.volumes import StoredVolume

if TYPE_CHECKING:
    import pandas as pd

    from matbench.sweeps import Sweep

SYNTHETIC_SCENES = ("synthetic/box", "synthetic/curved", "synthetic/weak")
RUNS = Path("runs")


@frozen(eq=False)
class Comparison:
    """A plan with its scenes in memory and its folder on disk, ready to run or to look at.

    Parameters
    ----------
    scenes
        Name -> scene, whole, for every scene of the plan.
    command
        The line that asked for it, for the report.
    left_out
        Why -> scenes that a pattern means but that cannot be compared.
    """

    plan: Plan
    store: Store
    scenes: Mapping[str, Scene]
    settings: Settings
    command: str
    left_out: Mapping[str, Sequence[str]] = {}

    @property
    def folder(self) -> Path:
        return self.store.folder

    def run(self, listen: run.Listener | None = None) -> None:
        """Compute what is not done yet."""
        names = {cell.method.algorithm for cell in self.plan.cells}
        found = plugins.algorithms([Path(file) for file in self.plan.plugin_files])
        entries = [found[name].entry for name in sorted(names)]
        preload = [entry.module for entry in entries if not isinstance(entry, type)]
        run.run(self.plan, self.store, self.settings, preload, listen)

    def tables(self) -> "tuple[pd.DataFrame, pd.DataFrame]":
        """Score the stored maps; write and return ``results.csv`` and ``cells.csv``."""
        results = scoring.results(self.plan, self.store, self.scenes)
        cells = scoring.cells(self.plan, self.store)
        for name, table in (("results.csv", results), ("cells.csv", cells)):
            write_text(self.folder / name, table.to_csv(index=False))
        return results, cells

    def sweeps(self, results: "pd.DataFrame") -> "list[Sweep]":
        """The curves of whatever takes several numbers; written as ``sweeps.csv`` if there are any."""
        from matbench.sweeps import sweeps, table

        found = sweeps(self.plan, results)
        if found:
            write_text(self.folder / "sweeps.csv", table(found).to_csv(index=False))
        return found

    def ablation(self, results: "pd.DataFrame") -> "pd.DataFrame":
        """What each factor does; written as ``ablation.csv`` and ``ablation.tex``, too."""
        from matbench.ablation import ablation
        from matbench.reports import switches

        table = ablation(self.plan, results)
        write_text(self.folder / "ablation.csv", table.to_csv(index=False))
        write_text(self.folder / "ablation.tex", switches.latex(table))
        return table

    def report(
        self,
        results: "pd.DataFrame",
        cells: "pd.DataFrame",
        ablation: "pd.DataFrame | None" = None,
        sweeps: "Sequence[Sweep]" = (),
    ) -> Path:
        """Write ``report.html``."""
        from matbench.reports import page

        reliability = scoring.reliabilities(self.plan, self.store, self.scenes)
        if len(reliability):
            write_text(self.folder / "reliability.csv", reliability.to_csv(index=False))
        stored = {(c.method.algorithm, c.method.changed, c.scene, c.seed): c for c in self.plan.cells}
        path = self.folder / "report.html"

        outcomes = {key: self.store.outcome(cell) for key, cell in stored.items()}

        def disparity(algorithm: str, params: str, scene: str, seed: int) -> NDArray[np.float32] | None:
            outcome = outcomes[algorithm, params, scene, seed]
            if outcome is None or outcome.status != "ok":
                return None
            return self.store.disparity(stored[algorithm, params, scene, seed])[self.scenes[scene].ref]

        def volume(algorithm: str, params: str, scene: str, seed: int) -> StoredVolume | None:
            outcome = outcomes[algorithm, params, scene, seed]
            kept = outcome is not None and outcome.has_volume
            return self.store.volume(stored[algorithm, params, scene, seed]) if kept else None

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
                ablation=ablation,
                sweeps=tuple(sweeps),
                reliability=reliability,
                higher=frozenset(m.name for m in scoring.metrics() if m.better == "higher"),
                volumes=volume,
                histories={key: outcome.history for key, outcome in outcomes.items() if outcome is not None},
                parameters={(c.method.algorithm, c.method.changed): c.method.params for c in self.plan.cells},
                row=self.settings.row,
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
    """All built-in methods that need not be told anything."""
    built_in = [p for p in plugins.installed("algorithms").values() if p.source == "matbench-stereo"]
    return [p.name for p in built_in if not spec.required(p.load())]


def default_scenes(data: str | Path | None = None) -> tuple[list[str], list[str]]:
    """Three synthetic scenes and the paper's three: those that are present, and those missing."""
    known = listings(data)
    present = {name for name, listing in known.items() if isinstance(listing, Listing) and listing.present}
    synthetic = [name for name in SYNTHETIC_SCENES if name in present]
    paper = [name for name in PAPER_SCENES if name in present]
    return synthetic + paper, [name for name in PAPER_SCENES if name not in present]


def read_request(path: Path) -> tuple[list[str], list[str] | None]:
    """Selectors of algorithms and scenes from a TOML file; None where it names no scenes.

    Raises
    ------
    UserError
        If the file is missing, is no TOML, or holds something else than the two lists.
    """
    try:
        found = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise UserError(f"{path} cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise UserError(f"{path} is not TOML: {error}") from error
    for key, value in found.items():
        if key not in ("algorithms", "scenes"):
            raise unknown(f"key in {path}", key, ("algorithms", "scenes"))
        if not (isinstance(value, list) and value and all(isinstance(one, str) for one in value)):
            raise UserError(f"{path}: {key} is {value!r}, not a list of texts such as {key} = ['...']")
    if "algorithms" not in found:
        raise UserError(f"{path} names no algorithms: write algorithms = ['materiality[pairs=all,consecutive]']")
    return found["algorithms"], found.get("scenes")


def _seeds(seed: object) -> list[int]:
    given = list(seed) if isinstance(seed, list | tuple | range) else [seed]
    try:
        found = [operator.index(one) for one in given if not isinstance(one, bool)]  # type: ignore[arg-type]
    except TypeError:
        found = []
    if len(found) != len(given) or not found or min(found) < 0:
        raise UserError(f"seed {seed!r} is not one or several whole numbers from 0")
    return list(dict.fromkeys(found))


def prepare(
    algorithms: str | Sequence[str] | None = None,
    scenes: str | Sequence[str] | None = None,
    *,
    settings: Settings = Settings(),
    out: str | Path | None = None,
    seed: int | Sequence[int] = 0,
    plugin: str | Path | Sequence[str | Path] = (),
    command: str | None = None,
) -> Comparison:
    """Check everything that was asked for, read every scene, and only then write the plan.

    Parameters are those of `compare`.
    """
    row = settings.row
    files = [Path(file).resolve() for file in ([plugin] if isinstance(plugin, str | Path) else plugin)]
    seeds = _seeds(seed)
    own = [p.name for file in files for p in plugins.from_file(file).values()]
    chosen = methods(algorithms if algorithms is not None else [*default_algorithms(), *own], files)
    root = data_root(settings.data)
    selected = select(scenes, root) if scenes is not None else Selection(tuple(default_scenes(root)[0]))
    if not chosen or not selected.names:
        raise UserError("nothing to compare: name at least one algorithm and one scene")
    named = {str(one) for one in spec.expand(scenes or ()) if not is_pattern(one.name)}
    loaded: dict[tuple[str, str], Scene] = {}  # a scene spelled in two ways is one scene
    spellings: dict[str, str] = {}
    left_out = {reason: list(names) for reason, names in selected.left_out.items()}
    for name in selected.names:
        try:
            scene = load_scene(name, root)
        except NotInScene:
            if name in named:
                raise
            left_out.setdefault("the scenes have not these views", []).append(name)
            continue
        if scene.ref not in scene.truth and scene.held_out is None:
            ref = scene.labels[scene.ref]
            raise UserError(
                f"{name} has no ground truth of its reference view {ref}: only [predict=left] or [predict=right]"
            )
        if row is not None and not 0 <= row < scene.height:
            raise UserError(f"row {row} of {name}: 0 to {scene.height - 1} is possible")
        kept = loaded.setdefault((scene.digest, scene.truth_digest), scene)
        if kept.name != scene.name:
            spellings[scene.name] = kept.name
    if not loaded:
        raise UserError(f"no scene has the views asked for: {', '.join(selected.names)}")
    by_name = {scene.name: scene for scene in loaded.values()}
    plan = make_plan(chosen, by_name, seeds, files, spellings)
    folder = Path(out) if out is not None else RUNS / plan.digest
    store = Store.open(folder, plan)
    said = command if command is not None else shlex.join(["matbench", *sys.argv[1:]])
    return Comparison(plan, store, by_name, evolve(settings, data=root), said, left_out)


def compare(
    algorithms: str | Sequence[str] | None = None,
    scenes: str | Sequence[str] | None = None,
    *,
    data: str | Path | None = None,
    out: str | Path | None = None,
    record: bool = False,
    volumes: bool = False,
    seed: int | Sequence[int] = 0,
    plugin: str | Path | Sequence[str | Path] = (),
    row: int | None = None,
) -> "pd.DataFrame":
    """Run methods on scenes and score them; the run folder stays for `matbench view` and the report.

    Parameters
    ----------
    algorithms
        Selectors such as ``"sgbm"`` or ``"materiality[pairs=all,consecutive]"``; all built-in
        methods, and those of `plugin`, if not given.
    scenes
        Selectors such as ``"synthetic/*"`` or ``"middlebury2003/teddy[views=0:9:2]"``; the
        default synthetic scenes (box, curved, weak) and the paper's three where they are present, if not given.
    data
        The folder of real scenes; without it the one that MATBENCH_DATA names, else the person's own.
    out
        The run folder; ``runs/<digest of the request>`` if not given. A folder that holds the
        same request is resumed.
    record
        Also write a rerun recording of every cell, from a second, untimed solve.
    volumes
        Also keep the volume of every cell whose method has one, and score it.
    seed
        One seed or several.
    plugin
        Python files that hold further methods.
    row
        The image row whose epipolar slices recordings show; the middle one if not given.

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
        settings=Settings(Path(data) if data is not None else None, record, row, volumes),
        out=out,
        seed=seed,
        plugin=plugin,
        command="matbench.compare(...)",
    )
    comparison.run()
    results, cells = comparison.tables()
    comparison.report(results, cells, sweeps=comparison.sweeps(results))
    return results
