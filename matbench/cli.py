"""The command line: `matbench compare`, `ablate`, `list` and `view`. Heavy imports happen where they are used."""

import json
import os
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import App, CycloptsError, Parameter
from rich import console as rich_console

from matbench._version import __version__
from matbench.errors import UserError

if TYPE_CHECKING:
    from matbench.comparison import Comparison


class Console(rich_console.Console):
    """A console that leaves a broken pipe to `main`."""

    def on_broken_pipe(self) -> None:
        raise BrokenPipeError


DONE, CELLS_FAILED, WRONG_USAGE, INTERRUPTED = 0, 1, 2, 130

app = App(
    name="matbench",
    help="Evaluation and benchmarking of multi-baseline stereo.",
    help_epilogue="""\
**Examples**

`matbench compare`  all built-in methods on the built-in scenes

`matbench compare -a sgbm -a 'materiality[views=4,5]' -s 'middlebury2006/*' --data DATA`

`matbench compare --plugin mine.py -a mine -s 'synthetic/box[noise=0,4,8]' --record`

`matbench ablate 'materiality[pairs=all,consecutive]' -s 'middlebury*/*' --data DATA`

`matbench list`  methods with their parameters, scenes, metrics

`matbench view runs/1a2b3c4d`  open a recording

`matbench scene check my_scene`  a scene of your own, a folder: is it what it says?
""",
    help_format="markdown",
    version=__version__,
)

Data = Annotated[Path | None, Parameter(name="--data", help="Folder of real scenes; else MATBENCH_DATA names it.")]
Plugins = Annotated[
    list[Path] | None,
    Parameter(name="--plugin", negative="", help="Python file with methods of your own; may be repeated."),
]


def _many(short: str, long: str, text: str) -> Parameter:
    return Parameter(name=[long, short], consume_multiple=True, negative="", help=text)


Seeds = Annotated[
    list[str] | None, Parameter(consume_multiple=True, negative="", help="Whole number, one or several; default 0.")
]


@app.command(help_epilogue="")
def compare(
    *,
    algorithm: Annotated[
        list[str] | None,
        _many("-a", "--algorithm", "Method, such as `sgbm` or `materiality[pairs=all,consecutive]`; default all."),
    ] = None,
    scene: Annotated[
        list[str] | None,
        _many("-s", "--scene", "Scene or pattern, such as `middlebury2003/teddy[views=0:9:2]` or `synthetic/*`."),
    ] = None,
    data: Data = None,
    out: Annotated[Path | None, Parameter(help="Run folder; default runs/ and a digest of what is asked for.")] = None,
    record: Annotated[bool, Parameter(negative="", help="Also write a recording of every cell for `view`.")] = False,
    seed: Seeds = None,
    plugin: Plugins = None,
    metric: Annotated[str, Parameter(name=["--metric", "-m"], help="Metric of the printed tables.")] = "total_bad_1",
) -> int:
    """Run methods on scenes, score them, and write tables and a report.

    Without arguments: all built-in methods on the synthetic scenes and on the paper's three where
    the data folder has them. The same line typed again takes up where it was interrupted.

    **Examples**

    `matbench compare`

    `matbench compare -a sgbm -a materiality -s middlebury2001/venus --data ~/stereo`

    `matbench compare -a 'okutomi_kanade[window=3,5,7]' -s 'synthetic/*' -m bad_2`
    """
    from matbench import comparison

    _check_metric(metric)
    if scene is None:
        _say_missing(comparison.default_scenes(data)[1], data)
    ready = comparison.prepare(
        algorithm, scene, data=data, out=out, record=record, seed=_whole(seed), plugin=plugin or ()
    )
    return _work(ready, metric)


@app.command(help_epilogue="")
def ablate(
    selector: str,
    *,
    scene: Annotated[
        list[str] | None, _many("-s", "--scene", "Scene or pattern, as for `compare`; the more, the better.")
    ] = None,
    data: Data = None,
    out: Annotated[Path | None, Parameter(help="Run folder; default runs/ and a digest of what is asked for.")] = None,
    seed: Seeds = None,
    plugin: Plugins = None,
    metric: Annotated[str, Parameter(name=["--metric", "-m"], help="Metric of the printed tables.")] = "total_bad_1",
) -> int:
    """Run every combination of a method's parameters and tell what each factor does.

    Differences are paired by scene, all else equal; intervals and effect sizes are over scenes.
    The first value of a parameter is the base that the others are compared with.

    **Examples**

    `matbench ablate 'materiality[pairs=all,consecutive binarization=plane,volume]' -s 'middlebury*/*' --data DATA`

    `matbench ablate algorithms/ablations/pairs.toml --data DATA`

    Parameters
    ----------
    selector
        Method with several values for its parameters, or a TOML file with `algorithms` and `scenes`.
    """
    from matbench import ablation, comparison
    from matbench.plan import methods

    _check_metric(metric)
    algorithms: list[str] = [selector]
    if selector.endswith(".toml"):
        algorithms, listed = comparison.read_request(Path(selector))
        scene = scene or listed
    ablation.factors(methods(algorithms, plugin or ()))
    ready = comparison.prepare(algorithms, scene, data=data, out=out, seed=_whole(seed), plugin=plugin or ())
    return _work(ready, metric, is_ablation=True)


def _whole(seeds: list[str] | None) -> list[int]:
    """Seeds as typed; a seed that is no whole number is refused, not rounded."""
    for seed in seeds or ():
        if not re.fullmatch(r"[0-9]{1,9}", seed):
            raise UserError(f"seed {seed!r} is not a whole number from 0 to 999999999")
    return [int(seed) for seed in seeds or ("0",)]


def _check_metric(metric: str) -> None:
    from matbench import scoring
    from matbench.errors import unknown

    names = [m.name for m in scoring.metrics()]
    if metric not in names:
        raise unknown("metric", metric, names)


def _work(ready: "Comparison", metric: str, is_ablation: bool = False) -> int:
    """Run, print and report a comparison; the exit status."""
    console = Console()
    stopped = _run(ready, console)
    results, cells = ready.tables()
    switches = ready.ablation(results) if is_ablation else None
    report = ready.report(results, cells, switches)
    _print_tables(results, cells, switches, metric, console)
    written = {"scores": ready.folder / "results.csv", "report": report}
    if is_ablation:
        written["ablation"] = ready.folder / "ablation.csv"
    for what, path in written.items():
        console.print(f"{what}: {path}", markup=False, highlight=False, soft_wrap=True)
    if any(ready.folder.glob("cells/*/recording.rrd")):
        console.print(f"recordings: matbench view {ready.folder}", markup=False, highlight=False, soft_wrap=True)
    if stopped:
        console.print("interrupted: the same command goes on from here")
        return INTERRUPTED
    return DONE if cells["status"].isin(["ok", "skipped"]).all() else CELLS_FAILED


def _say_missing(missing: Sequence[str], data: Path | None) -> None:
    if missing:
        from matbench.scenes import DATA_VARIABLE, data_root

        root = data_root(data)
        why = f"not under {root}" if root else f"give the folder of real scenes by --data or {DATA_VARIABLE}"
        print(f"without {', '.join(missing)}: {why}")


def _run(ready: "Comparison", console: Console) -> bool:
    """Run a comparison with progress shown; True if it was interrupted."""
    from rich.markup import escape
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    from matbench.run import pending

    todo = len(pending(ready.plan, ready.store, ready.record))
    total = len(ready.plan.cells)
    if todo < total:
        console.print(f"{total - todo} of {total} cells are done already in {ready.folder}", highlight=False)
    columns = (BarColumn(24), MofNCompleteColumn(), TimeElapsedColumn(), TextColumn("{task.description}"))
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("starting", total=total, completed=total - todo)

        def listen(event: str, cell: Any, outcome: Any) -> None:
            if event == "start":
                progress.update(task, description=escape(str(cell)))
                return
            progress.advance(task)
            took = f" {outcome.seconds:.2f} s" if outcome.seconds is not None else ""
            took += f" {outcome.reason}" if outcome.reason else ""
            if not console.is_terminal or outcome.reason:
                line = f"{outcome.status:>7}  {cell}{took}"
                progress.console.print(line, markup=False, highlight=False, soft_wrap=True)

        try:
            ready.run(listen)
        except KeyboardInterrupt:
            return True
    return False


def _print_tables(results: Any, cells: Any, switches: Any, metric: str, console: Console) -> None:
    from matbench import scoring
    from matbench.reports import switches as effects
    from matbench.reports import tables

    higher = next(m.better for m in scoring.metrics() if m.name == metric) == "higher"
    for table in tables.terminal(results, cells, metric, higher, console.width):
        console.print(table)
    if switches is not None:
        for table in effects.terminal(switches, metric):
            console.print(table)


app.command("matbench.commands.scene:app", name="scene", help="Look at scenes, check them, and make your own.")


@app.command(name="list", help_epilogue="")
def list_(
    *,
    data: Data = None,
    plugin: Plugins = None,
    as_json: Annotated[bool, Parameter(name="--json", negative="", help="Machine-readable.")] = False,
) -> int:
    """Show algorithms with their parameters, scenes with their sizes, and metrics.

    **Examples**

    `matbench list`

    `matbench list --data ~/stereo --json`
    """
    from matbench import listing

    known = listing.known(data, plugin or ())
    if as_json:
        print(json.dumps(known, indent=1))
    else:
        console = Console()
        for table in listing.tables(known):
            console.print(table)
    return DONE


@app.command(help_epilogue="")
def view(
    run: Path,
    cell: str | None = None,
    *,
    web: Annotated[bool, Parameter(negative="", help="In the browser instead of a window.")] = False,
) -> int:
    """Open the recording of a cell.

    **Examples**

    `matbench view runs/1a2b3c4d`

    `matbench view runs/1a2b3c4d 'materiality on synthetic/box' --web`

    Parameters
    ----------
    run
        Run folder that was written with `compare --record`, or a recording, such as of `scene show --record`.
    cell
        Part of the cell's name or key; not needed where there is only one recording.
    """
    from matbench import recording
    from matbench.store import Store

    recording.view(run if run.suffix == ".rrd" else Store(run).recording(cell), web)
    return DONE


def main(tokens: Sequence[str] | None = None) -> None:
    """Run the command line and exit: 0 all well, 1 cells failed, 2 wrong usage, 130 interrupted."""
    try:
        status = app(tokens, exit_on_error=False, print_error=False, result_action="return_value")
    except UserError as error:
        status = _refuse(str(error))
    except CycloptsError as error:
        status = _refuse(" ".join(str(error).split()))
    except KeyboardInterrupt:
        print("matbench: interrupted", file=sys.stderr)
        status = INTERRUPTED
    except BrokenPipeError:  # whoever read the output has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        status = DONE
    except OSError as error:
        status = _refuse(f"{error.filename or 'output'}: {error.strerror}")
    sys.exit(status)


def _refuse(message: str) -> int:
    print(f"matbench: {' '.join(message.splitlines())}", file=sys.stderr)
    return WRONG_USAGE
