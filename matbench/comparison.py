"""A whole comparison: choose methods and scenes, run, score, report."""

import shlex
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from attrs import evolve, frozen

from matbench.errors import UserError
from matbench.plans import plugins
from matbench.plans.plan import Method, make_plan, methods
from matbench.plans.record_option import RecordOption
from matbench.plans.request import seeds_of
from matbench.plans.settings import Settings
from matbench.prepared import Comparison
from matbench.runs.lock import locked
from matbench.runs.store import Store
from matbench.scene import Scene
from matbench.scenes.catalogue import data_root
from matbench.scenes.chosen import choose
from matbench.solving.compile_ahead import Ahead, methods_to_compile

if TYPE_CHECKING:
    import pandas as pd


RUNS = Path("runs")


@frozen(eq=False)
class Growth:
    """What else is known of a run to which scenes are added.

    Parameters
    ----------
    among
        All scenes that it may come to (`matbench.plans.plan.Plan.among`).
    known
        Scenes that it has read already, by name.
    """

    among: Sequence[str] = ()
    known: Mapping[str, Scene] = {}


def prepare(
    algorithms: str | Sequence[str] | None = None,
    scenes: str | Sequence[str] | None = None,
    *,
    settings: Settings = Settings(),
    out: str | Path | None = None,
    seed: int | Sequence[int] = 0,
    plugin: str | Path | Sequence[str | Path] = (),
    command: str | None = None,
    repeats: int = 1,
    write: bool = True,
    growth: Growth | None = None,
) -> Comparison:
    """Check everything that was asked for, read every scene, and only then write the plan.

    Parameters are those of `compare`, and `growth` of a run whose scenes are not all; without `write` not even the plan
    is written.
    """
    given = [plugin] if isinstance(plugin, str | Path) else plugin
    for path in (*given, *([] if out is None else [out])):
        if "\0" in str(path):
            raise UserError(f"{str(path)!r} is no path: no file can have that name")
    files = [Path(file).resolve() for file in given]
    with plugins.using(files):
        return _prepare(algorithms, scenes, settings, out, seed, files, command, repeats, write, growth or Growth())


def _prepare(
    algorithms: str | Sequence[str] | None,
    scenes: str | Sequence[str] | None,
    settings: Settings,
    out: str | Path | None,
    seed: int | Sequence[int],
    files: Sequence[Path],
    command: str | None,
    repeats: int,
    write: bool,
    growth: Growth,
) -> Comparison:
    """`prepare`, within the block in which users' own scenes are found."""
    if not 1 <= repeats <= 100:
        raise UserError(f"repeats {repeats} is not a whole number from 1 to 100")
    rows = settings.record.rows if settings.record is not None else ()
    seeds = seeds_of(seed)
    own = [p.name for file in files for p in plugins.from_file(file).values()]
    chosen = methods(algorithms if algorithms is not None else [*plugins.default_algorithms(), *own], files)
    root = data_root(settings.data)
    if not chosen:
        raise UserError("nothing to compare: name at least one algorithm and one scene")
    ahead = _compiling(chosen) if write and settings.dask is None else None
    try:
        found = choose(scenes, root, rows, growth.known)
        if settings.published:
            from matbench.reports import published

            published.check(found.scenes)
        plan = make_plan(chosen, found.scenes, seeds, files, found.spellings, repeats, growth.among)
        folder = Path(out) if out is not None else RUNS / plan.digest
        said = command if command is not None else shlex.join(["matbench", *sys.argv[1:]])
        settings = evolve(settings, data=root)
        ready = Comparison(plan, Store(folder), found.scenes, settings, said, found.left_out, tuple(files), ahead=ahead)
        ready.store.check(plan)
        if settings.against is not None:
            ready.shared_with(settings.against)
        if write:
            Store.open(folder, plan, said)
    except BaseException:
        if ahead is not None:
            ahead.stop()
        raise
    return ready


def _compiling(chosen: Sequence[Method]) -> Ahead | None:
    """Begin to compile the kernels of the methods, where none are kept; scenes are read meanwhile."""
    kept = plugins.kernel_cache()
    selectors = methods_to_compile(chosen, kept)
    return Ahead.begin(selectors, kept) if selectors else None


def compare(
    algorithms: str | Sequence[str] | None = None,
    scenes: str | Sequence[str] | None = None,
    *,
    data: str | Path | None = None,
    out: str | Path | None = None,
    record: bool | RecordOption = False,
    volumes: bool = False,
    seed: int | Sequence[int] = 0,
    plugin: str | Path | Sequence[str | Path] = (),
    row: int | Sequence[int] | None = None,
    repeats: int = 1,
    settings: Settings = Settings(),
) -> "pd.DataFrame":
    """Run methods on scenes and score them; the run folder stays for `matbench view` and the report.

    Parameters
    ----------
    algorithms
        Selectors such as ``"sgbm"`` or ``"materiality[pairs=all,consecutive]"``; the built-in
        methods, and those of `plugin`, if not given.
    scenes
        Selectors such as ``"synthetic/*"`` or ``"middlebury2003/teddy[views=0:9:2]"``; the
        twelve worlds of ``worlds/quick``, and the paper's three where they are present, if not given.
    data
        The folder of real scenes; by default the one that MATBENCH_DATA names, else the user's data folder.
    out
        The run folder; ``runs/<digest of the request>`` if not given. A folder that holds the
        same request is resumed.
    record
        Also write a rerun recording of every cell, from a second, untimed solve. True records everything; a
        `RecordOption` chooses.
    volumes
        Also keep the volume of every cell whose method has one, and score it.
    seed
        One seed or several.
    plugin
        Python files that hold further methods, scenes and metrics.
    row
        The image row whose epipolar slices recordings show, or several; the middle one if not given.
    repeats
        How often every cell is solved; more than once shows whether a method repeats itself.
    settings
        Limits, how many cells run at once, a cluster, which cells to run. Parameters of this function override it.

    Returns
    -------
    DataFrame
        ``results.csv``: one row for each method, scene, seed, region and metric.

    Raises
    ------
    UserError
        If anything that was asked for is impossible. Nothing is written then.
    """
    wanted = record if isinstance(record, RecordOption) else RecordOption() if record else settings.record
    if wanted is not None and row is not None:
        wanted = evolve(wanted, rows=[row] if isinstance(row, int) else row)
    comparison = prepare(
        algorithms,
        scenes,
        settings=evolve(
            settings,
            data=Path(data) if data is not None else settings.data,
            record=wanted,
            volumes=volumes or settings.volumes,
        ),
        out=out,
        seed=seed,
        plugin=plugin,
        command="matbench.compare(...)",
        repeats=repeats,
    )
    with locked(comparison.folder):
        todo = comparison.pending()
        comparison.run(todo=todo)
        tables = comparison.kept(todo)
        if tables is None:
            tables = comparison.tables()
            comparison.report(tables, sweeps=comparison.sweeps(tables.results))
    return tables.results
