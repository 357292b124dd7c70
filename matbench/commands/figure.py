"""`matbench figure`: figures like 2 and 3 of the paper, and mean ranks, drawn from any run."""

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from attrs import evolve
from cyclopts import App, Parameter

from matbench.commands.console import DONE, Console, complain
from matbench.commands.options import Data, Plugins
from matbench.errors import UserError, unknown

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from matbench.measures.metrics import Metric
    from matbench.plans.plan import Cell
    from matbench.reports.paper_figure import CaptionedFigure
    from matbench.runs.store import Store
    from matbench.scene import Scene

app = App(
    name="figure",
    help="Draw the figures of a finished run for a paper, in the size of a column: PDF, PNG, and the caption.",
    help_epilogue="""\
Beside each figure lie its caption as text and what a paper includes as LaTeX.

**Examples**

`matbench figure slice runs/1a2b3c4d 'materiality on middlebury2001/tsukuba' --row 144 --data DATA`

`matbench figure maps runs/1a2b3c4d -s 'middlebury*/*' -a materiality -a sgbm --errors`

`matbench figure ranks runs/1a2b3c4d`

`matbench figure confidence runs/1a2b3c4d`
""",
    help_format="markdown",
)

Out = Annotated[
    Path | None,
    Parameter(name=["--out", "-o"], help="Where to, without an ending; default in the run folder."),
]
Algorithms = Annotated[
    list[str] | None,
    Parameter(
        name=["--algorithm", "-a"], consume_multiple=True, negative="", help="Part of a method's name; default all."
    ),
]
Width = Annotated[
    Literal["column", "page"], Parameter(help="3.25 in, a column, or 6.875 in, both columns and what is between.")
]


@app.command(name="slice", help_epilogue="")
def slice_(
    run: Path,
    cell: str | None = None,
    *,
    row: Annotated[str | None, Parameter(help="Image row; default the middle one.")] = None,
    out: Out = None,
    width: Width = "column",
    data: Data = None,
    plugin: Plugins = [],  # noqa: B006 -- never changed
) -> int:
    """Draw one epipolar plane of a cell: similarity, visibility, materiality, energy derivative (the paper's figure 2).

    The cell is solved once more to see inside the method. You are told if the answer is not the stored one.

    **Examples**

    `matbench figure slice runs/1a2b3c4d --row 144`

    `matbench figure slice runs/1a2b3c4d 'materiality on middlebury2003/teddy' --width page --data DATA`

    Parameters
    ----------
    run
        Folder of a finished run.
    cell
        Part of the cell's name or key; not needed where there is only one.
    """
    from matbench.plans import plugins
    from matbench.plans.record_option import RecordOption
    from matbench.reports import slice_figure
    from matbench.runs.store import Store
    from matbench.solving.captured_solve import solve_captured

    store, console = Store(run), Console()
    plan = store.plan()
    chosen = _one(plan.cells, cell)
    wanted = evolve(RecordOption.of(rows=row), volumes=False)
    if len(wanted.rows) > 1:
        raise UserError(f"row {row!r}: a figure shows one")
    given, own = [file.resolve() for file in plugin], chosen.method.file
    # a run folder may come from anywhere: what it names is not executed
    if own and Path(own) not in given:
        raise UserError(f"{chosen.method} is in a file of its own: add --plugin {shlex.quote(own)}")
    if not own and chosen.method.algorithm not in plugins.algorithms(plugin) and plan.plugin_files:
        raise UserError(
            f"{chosen.method.algorithm} is in a file of its own: add --plugin {shlex.join(plan.plugin_files)}"
        )
    scene = _scene(chosen, data, plugin, console)
    if wanted.rows and wanted.rows[0] >= scene.height:
        raise UserError(f"row {row} of {scene.name}: 0 to {scene.height - 1} is possible")
    stem = _stem(out, run, f"slice-{chosen}")
    with console.busy(f"{chosen}: solving once more"):
        told = solve_captured(chosen, plugin, scene, wanted.at(scene.height))
    plane = slice_figure.epipolar_plane(scene, told.probe, told.estimate)
    if plane is None:
        raise UserError(f"{chosen.method} tells nothing of disparity space: no volume, no similarities")
    stored = _stored(store, chosen, scene)
    if stored is not None and not np.array_equal(stored, told.estimate.disparity[scene.ref], equal_nan=True):
        console.say("the answer differs from the stored one: the code has changed since the run, or was not repeatable")
    with console.busy("drawing"):
        _write(slice_figure.draw(scene, plane, str(chosen.method), width), stem, console)
    return DONE


@app.command(help_epilogue="")
def maps(
    run: Path,
    *,
    algorithm: Algorithms = None,
    scene: Annotated[
        list[str] | None,
        Parameter(name=["--scene", "-s"], consume_multiple=True, negative="", help="Scene or pattern; default all."),
    ] = None,
    errors: Annotated[bool, Parameter(negative="", help="Below each map its errors.")] = False,
    metric: Annotated[
        str | None, Parameter(name=["--metric", "-m"], help="Below each map the picture of a metric that has one.")
    ] = None,
    out: Out = None,
    width: Width = "column",
    data: Data = None,
    plugin: Plugins = [],  # noqa: B006 -- never changed
) -> int:
    """Draw reference views, true disparities and the methods' maps, one scene a column (the paper's figure 3).

    Maps are those of the run folder; views and truths are read from the scenes. Of several seeds the first is shown.

    **Examples**

    `matbench figure maps runs/1a2b3c4d`

    `matbench figure maps runs/1a2b3c4d -s 'synthetic/*' -a materiality --errors --width page`

    `matbench figure maps runs/1a2b3c4d -m bias`

    Parameters
    ----------
    run
        Folder of a finished run.
    """
    from matbench.reports import map_figure
    from matbench.runs.store import Store

    store, console, pictured = Store(run), Console(), _pictured(metric, plugin)
    cells = store.plan().cells
    methods = list(dict.fromkeys(str(c.method) for c in cells))
    names = list(dict.fromkeys(c.scene for c in cells))
    methods = _matching("method", methods, algorithm)
    names = _matching("scene", names, scene)
    stem = _stem(out, run, "maps")
    scenes: dict[str, Scene] = {}
    found: dict[tuple[str, str], NDArray[np.float32]] = {}
    with console.busy("reading") as status:
        chosen = [cell for cell in cells if cell.scene in names and str(cell.method) in methods]
        for cell in chosen:
            if cell.scene not in scenes:
                status.update(f"{cell.scene}: reading")
                scenes[cell.scene] = _scene(cell, data, plugin, console)
            known = scenes[cell.scene]
            stored = _stored(store, cell, known)
            if stored is not None and stored.shape == (known.height, known.width):
                found.setdefault((str(cell.method), cell.scene), stored)
    if not found:
        raise UserError(f"no disparity map to draw: {_lacking(store, chosen)}")
    with console.busy("drawing"):
        shown = map_figure.Maps(tuple(scenes[n] for n in names), tuple(methods), found)
        drawn = map_figure.draw(shown, width, errors, pictured)
        _write(drawn, stem, console)
    return DONE


@app.command(help_epilogue="")
def ranks(
    run: Path,
    *,
    metric: Annotated[str, Parameter(name=["--metric", "-m"], help="What methods are ranked by.")] = "total_bad_1",
    region: Annotated[str, Parameter(help="In which region.")] = "all",
    out: Out = None,
    width: Width = "column",
    plugin: Plugins = [],  # noqa: B006 -- never changed
) -> int:
    """Draw mean ranks with their critical difference: which methods may chance have ordered?

    **Examples**

    `matbench figure ranks runs/1a2b3c4d`

    `matbench figure ranks runs/1a2b3c4d -m avg --region occ --width page`

    Parameters
    ----------
    run
        Folder of a finished run.
    """
    from matbench.measures.statistics import FEW
    from matbench.plans.plugins import using
    from matbench.reports import rank_figure, run_tables, standing, tables
    from matbench.results import metric_catalogue

    results, cells = run_tables.read_run(run)
    if said := run_tables.doubt(run):
        complain(said)
    stem, console = _stem(out, run, f"ranks-{metric}-{region}"), Console()
    scope, units = tables.shared(results, cells), tables.metrics(results)
    for kind, name, known in (("metric", metric, units), ("region", region, tables.regions(results))):
        if name not in known:
            raise unknown(f"{kind} of this run", name, known)
    with using(plugin):
        better = metric_catalogue.better(metric)
    silent = tables.too_silent(tables.means(results, scope, region, metric, "answered"))
    scored = tables.per_scene(results, region, metric)
    found = standing.ranking(scored, scope, units[metric], better, silent)
    if found is None:
        raise UserError(f"ranks have a critical difference from three ranked methods and {FEW} scenes on: run more")
    _write(rank_figure.draw(found, metric, region, width), stem, console)
    return DONE


@app.command(help_epilogue="")
def confidence(
    run: Path,
    *,
    algorithm: Algorithms = None,
    out: Out = None,
    width: Width = "column",
) -> int:
    """Draw what confidence is worth: the errors among the pixels of which a method is surest.

    Only methods that give a confidence have a line. The surest pixels are on the left, all answered ones on the right.

    **Examples**

    `matbench figure confidence runs/1a2b3c4d`

    `matbench figure confidence runs/1a2b3c4d -a materiality -a multiview_sgm --width page`

    Parameters
    ----------
    run
        Folder of a finished run.
    """
    from matbench.reports import confidence_figure, run_tables, tables

    results, cells = run_tables.read_run(run)
    points, console = run_tables.read_points(run), Console()
    if said := run_tables.doubt(run):
        complain(said)
    needs = "that takes a method that gives one, as materiality does, and answers with known truth"
    if points.empty:
        raise UserError(f"{str(run)!r} has no confidence to draw: {needs}")
    scope = tables.shared(results, cells)
    methods, points = _matching("method", list(scope.methods), algorithm), confidence_figure.comparable(points, scope)
    found = confidence_figure.curves(points, methods)
    if not found:
        raise UserError(f"none of these methods has a confidence to draw: {', '.join(methods)}; {needs}")
    drawn = confidence_figure.draw(found, confidence_figure.scenes_of(points, found), width)
    _write(drawn, _stem(out, run, "confidence"), console)
    return DONE


def _pictured(name: str | None, plugin: "Sequence[Path]") -> "Metric | None":
    """The metric whose picture is drawn."""
    from matbench.measures.metrics import Metric
    from matbench.plans.plugins import using
    from matbench.results import metric_catalogue

    if name is None:
        return None
    with using(plugin):
        found, every = metric_catalogue.metric_named(name), metric_catalogue.metrics()
    if not (isinstance(found, Metric) and found.picture is not None):
        have = ", ".join(m.name for m in every if isinstance(m, Metric) and m.picture is not None)
        raise UserError(f"metric {name} has no picture: {have} have one")
    return found


def _one(cells: "Sequence[Cell]", part: str | None) -> "Cell":
    """The one cell whose name or key is `part` or, failing that, contains it."""
    hits = [c for c in cells if part is None or part in str(c) or part in c.key]
    exact = [c for c in hits if str(c) == part]
    if len(exact or hits) != 1:
        which = f"{len(hits)} cells match {part!r}" if part else f"there are {len(hits)} cells"
        raise UserError(f"{which}: name one of {'; '.join(str(c) for c in hits or cells)}")
    return (exact or hits)[0]


def _matching(kind: str, names: list[str], wanted: list[str] | None) -> list[str]:
    """The names that equal, match or contain one of those wanted."""
    from fnmatch import fnmatchcase

    if wanted is None:
        return names
    for one in wanted:
        if not any(one in name or fnmatchcase(name, one) for name in names):
            raise UserError(f"no {kind} of this run is or contains {one!r}: there are {', '.join(names)}")
    exact = [name for name in names if name in wanted]
    rest = [one for one in wanted if one not in exact]
    return [n for n in names if n in exact or any(one in n or fnmatchcase(n, one) for one in rest)]


def _scene(cell: "Cell", data: Path | None, plugin: "Sequence[Path]", console: Console) -> "Scene":
    """The scene of a cell; refused if it has changed since the run."""
    from matbench.scenes.catalogue import load_scene

    with console.busy(f"{cell.scene}: reading"):
        scene = load_scene(cell.scene, data, plugin)
    if scene.digest != cell.scene_digest:
        raise UserError(f"{cell.scene} is not what it was in the run: its images or its options' meaning have changed")
    return scene


def _stored(store: "Store", cell: "Cell", scene: "Scene") -> "NDArray[np.float32] | None":
    """The stored map of the reference view of a cell that is ok."""
    return store.read(cell).maps.get(scene.ref)


def _lacking(store: "Store", cells: "Sequence[Cell]") -> str:
    """What became of cells of which none has a map: how many there are, and the first one's reason."""
    outcome = store.outcome(cells[0])
    became = "not computed yet" if outcome is None else f"{outcome.status} {outcome.reason}".strip()
    return f"none of {len(cells)} cells is ok; {cells[0]}: {became}"


def _stem(out: Path | None, run: Path, name: str) -> Path:
    """The path of a figure without its ending; refused if the folder does not exist."""
    import re

    from matbench.files.writing import is_writable

    if out is None and not is_writable(run):
        raise UserError(f"run folder {str(run)!r} is read-only: say by --out where the figure goes")
    stem = run / re.sub(r"[^\w.+]+", "-", name).strip("-.") if out is None else out
    if stem.suffix.lower() in (".pdf", ".png"):
        stem = stem.with_suffix("")
    if not stem.parent.is_dir():
        raise UserError(f"folder {str(stem.parent)!r} of --out does not exist")
    return stem


def _write(drawn: "CaptionedFigure", stem: Path, console: Console) -> None:
    from matbench.reports import paper_figure

    for path in paper_figure.write_figure(drawn, stem):
        console.say(f"{path.suffix[1:]}: {path}")
