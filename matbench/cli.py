"""The command line: all commands of `matbench`. Heavy imports happen where they are used."""

import json
import os
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from attrs import evolve, field, frozen
from cyclopts import App, CycloptsError, Parameter, UnusedCliTokensError
from rich import console as rich_console

from matbench import limits
from matbench._version import __version__
from matbench.errors import UserError
from matbench.recorded import Recording
from matbench.settings import Only, Settings


class Console(rich_console.Console):
    """A console that prints what it is told, word for word, and leaves a broken pipe to `main`."""

    def say(self, line: str) -> None:
        """Print a line that may be of any length and hold anything, such as paths."""
        self.print(line, markup=False, highlight=False, soft_wrap=True)

    def on_broken_pipe(self) -> None:
        raise BrokenPipeError


DONE, FAILED, WRONG_USAGE, INTERRUPTED = 0, 1, 2, 130

app = App(
    name="matbench",
    help="Evaluation and benchmarking of multi-baseline stereo.",
    help_epilogue="""\
**Examples**

`matbench compare`  all built-in methods on the built-in scenes

`matbench compare -a sgbm -a 'materiality[views=4,5]' -s 'middlebury2006/*' --data DATA`

`matbench compare --plugin mine.py -a mine -s 'synthetic/box[noise=0,4,8]' --record`

`matbench compare -s 'synthetic/box[noise=0,2,4,8]'`  several numbers give a curve in the report

`matbench ablate 'materiality[pairs=all,consecutive]' -s 'middlebury*/*' --data DATA`

`matbench check mine.py`  does a method of your own keep to what is asked of it?

`matbench status runs/1a2b3c4d`  where a run stands, also while it runs

`matbench list`  methods with their parameters, scenes, metrics

`matbench fetch paper`  download the paper's three scenes

`matbench view runs/1a2b3c4d`  open a recording

`matbench report runs/1a2b3c4d --format tex`  the table for a paper; `figure` draws its figures

`matbench scene check my_scene`  a scene of your own, a folder: is it what it says?

**Exit status**

0 all well, 1 cells failed, 2 wrong usage, 3 slower or worse than the baseline, 130 interrupted
""",
    help_format="markdown",
    version=__version__,
    suppress_keyboard_interrupt=False,  # `main` says so
)

Data = Annotated[
    Path | None,
    Parameter(name="--data", help="Folder of real scenes; else MATBENCH_DATA, else where `fetch` puts them."),
]
Plugins = Annotated[
    list[Path],
    Parameter(
        name="--plugin", negative="", show_default=False, help="Python file with methods of your own; may be repeated."
    ),
]


def _many(short: str, long: str, text: str) -> Parameter:
    return Parameter(name=[long, short], consume_multiple=True, negative="", help=text)


@Parameter(name="*")
@frozen
class Options:
    """What `compare` and `ablate` both take."""

    data: Data = None
    out: Annotated[Path | None, Parameter(help="Run folder; default runs/ and a digest of what is asked for.")] = None
    seed: Annotated[
        list[str],
        Parameter(
            consume_multiple=True, negative="", show_default=False, help="Whole number, one or several; default 0."
        ),
    ] = field(factory=lambda: ["0"])
    plugin: Plugins = field(factory=list)
    metric: Annotated[str, Parameter(name=["--metric", "-m"], help="Metric of the printed tables.")] = "total_bad_1"
    timeout: Annotated[
        str, Parameter(help="Seconds that each cell may take, reading, warm-up and recording included; or none.")
    ] = f"{limits.HOUR:g}"
    memory: Annotated[
        str | None, Parameter(help="Memory that each cell may hold, such as 4G; default a share of the machine's.")
    ] = None
    jobs: Annotated[str, Parameter(help="Cells that run at once. Their seconds are then marked as not comparable.")] = (
        "1"
    )
    threads: Annotated[
        str | None, Parameter(help="Threads that each method is given; default the cores, shared out to the jobs.")
    ] = None
    isolation: Annotated[
        str, Parameter(help="process: one for each cell; shared: one for many, for methods that you trust.")
    ] = "process"
    dask: Annotated[
        str | None,
        Parameter(help="Dask scheduler that hands out the cells, tcp://HOST:PORT; or local: JOBS workers here."),
    ] = None
    only: Annotated[
        Only | None,
        Parameter(
            help="`missing`: cells never computed, `failed`: those that did not end well, `all`: every cell again; "
            "default what is not done."
        ),
    ] = None
    repeats: Annotated[str, Parameter(help="Solve every cell so often: does a method repeat itself?")] = "1"
    dry_run: Annotated[bool, Parameter(negative="", help="Only say what would run, and why.")] = False
    quiet: Annotated[
        bool,
        Parameter(
            name=["--quiet", "-q"],
            negative="",
            show_default=False,
            help="Print nothing but the run folder, and what failed as errors.",
        ),
    ] = False
    as_json: Annotated[
        bool,
        Parameter(
            name="--json",
            negative="",
            show_default=False,
            help="Print one JSON document at the end: folder, cells, table; progress goes to the error stream.",
        ),
    ] = False

    @property
    def settings(self) -> Settings:
        """How to run, but for what is kept."""
        return Settings(
            self.data,
            timeout=self.timeout,
            memory=self.memory,
            jobs=self.jobs,
            threads=self.threads,
            isolation=self.isolation,
            dask=self.dask,
            only=self.only,
        )

    @property
    def seeds(self) -> list[int]:
        return [_whole("seed", one) for one in self.seed]


DEFAULTS = Options()


@app.command(help_epilogue="")
def compare(
    *,
    algorithm: Annotated[
        list[str] | None,
        _many("-a", "--algorithm", "Method, such as `sgbm` or `materiality[pairs=all,consecutive]`; default all."),
    ] = None,
    scene: Annotated[
        list[str] | None,
        _many(
            "-s", "--scene", "Scene or pattern, such as `middlebury2003/teddy[views=0:9:2]`, `synthetic/*` or `paper`."
        ),
    ] = None,
    record: Annotated[
        list[str] | None,
        Parameter(
            consume_multiple=True,
            negative="",
            help="Also write a recording of every cell for `view`; default of all, "
            "else of some of slices,volumes,space,surface,passes=N.",
        ),
    ] = None,
    row: Annotated[
        str | None,
        Parameter(name=["--row", "--rows"], help="Image rows of the recordings' slices; default the middle one."),
    ] = None,
    volumes: Annotated[
        bool, Parameter(negative="", help="Also keep and score the volumes of methods that have one.")
    ] = False,
    options: Options = DEFAULTS,
) -> int:
    """Run methods on scenes, score them, and write tables and a report.

    Without arguments: all built-in methods on three synthetic scenes and on the paper's three where
    the data folder has them. The same line typed again takes up where it was interrupted.

    **Examples**

    `matbench compare`

    `matbench compare -a sgbm -a materiality -s middlebury2001/venus --data ~/stereo`

    `matbench compare -a 'okutomi_kanade[window=3,5,7]' -s 'synthetic/*' -m bad_2`

    An option of a scene, or a parameter, that takes three numbers or more gives curves. `views=N` is that many views
    as wide as they fit, `baseline=N` how many view steps apart the outermost are:

    `matbench compare -a okutomi_kanade -s 'middlebury2003/teddy[views=3 baseline=2,4,6]' --data DATA`

    Recordings of chosen rows, or of chosen parts only:

    `matbench compare -a materiality -s synthetic/box --record --rows 60,120,180`

    `matbench compare -a materiality -s synthetic/box --record slices,passes=10`

    Scores of volumes, which are kept; and of predictions of the rightmost view, which is not given:

    `matbench compare -a materiality -s synthetic/box -m surface_f_1`

    `matbench compare -s 'synthetic/*[predict=right]' -m prediction_psnr`

    Four cells at once, none of them longer than ten minutes or larger than 2 GiB; on a Dask cluster:

    `matbench compare --jobs 4 --timeout 600 --memory 2G`

    `matbench compare --dask tcp://head:8786`

    In a script, where the exit status tells 0 all well, 1 cells failed, 2 wrong usage, 130 interrupted:

    `matbench compare -a sgbm -s synthetic/box --json`
    """
    from matbench import comparison
    from matbench.commands import running

    check_metric(options.metric)
    if row is not None and record is None:
        raise UserError(f"--row {row} chooses what recordings show: add --record")
    if scene is None:
        running.say_missing(comparison.default_scenes(options.data)[1], options)
    ready = comparison.prepare(
        algorithm,
        scene,
        settings=evolve(
            options.settings,
            record=None if record is None else Recording.of(record, row),
            volumes=volumes or _is_of_volumes(options.metric),
        ),
        out=options.out,
        seed=options.seeds,
        plugin=options.plugin,
        repeats=_whole("repeats", options.repeats),
        write=not options.dry_run,
    )
    return running.show_plan(ready, options) if options.dry_run else running.work(ready, options)


@app.command(help_epilogue="")
def ablate(
    selector: str,
    *,
    scene: Annotated[
        list[str] | None, _many("-s", "--scene", "Scene or pattern, as for `compare`; the more, the better.")
    ] = None,
    options: Options = DEFAULTS,
) -> int:
    """Run every combination of a method's parameters and tell what each factor does.

    Differences are paired by scene, all else equal; intervals and effect sizes are over scenes.
    The first value of a parameter is the base that the others are compared with. Options of scenes may vary, too:
    what takes three numbers or more gives curves.

    **Examples**

    `matbench ablate 'materiality[pairs=all,consecutive binarization=plane,volume]' -s 'middlebury*/*' --data DATA`

    `matbench ablate algorithms/ablations/pairs.toml --data DATA`

    `matbench ablate 'materiality[views=0]' -s 'middlebury*/*[views=2,3,5,7,9]' --data DATA`

    Parameters
    ----------
    selector
        Method with several values for its parameters, or a TOML file with `algorithms` and `scenes`.
    """
    from matbench import ablation, comparison
    from matbench.commands import running
    from matbench.plan import methods

    check_metric(options.metric)
    algorithms: list[str] = [selector]
    if selector.endswith(".toml"):
        algorithms, listed = comparison.read_request(Path(selector))
        scene = scene or listed
    chosen = methods(algorithms, options.plugin)
    ablation.check_varies(chosen, scene or ())
    ready = comparison.prepare(
        algorithms,
        scene,
        settings=evolve(options.settings, volumes=_is_of_volumes(options.metric)),
        out=options.out,
        seed=options.seeds,
        plugin=options.plugin,
        repeats=_whole("repeats", options.repeats),
        write=not options.dry_run,
    )
    if options.dry_run:
        return running.show_plan(ready, options)
    return running.work(ready, options, is_ablation=any(ablation.factors(chosen).values()))


def _whole(name: str, text: str) -> int:
    """A number as typed; one that is not whole is refused, not rounded."""
    if not re.fullmatch(r"[0-9]{1,9}", text):
        raise UserError(f"{name} {text!r} is not a whole number from 0 to 999999999")
    return int(text)


def check_metric(metric: str) -> None:
    from matbench import scoring
    from matbench.errors import unknown

    names = [m.name for m in scoring.metrics()]
    if metric not in names:
        raise unknown("metric", metric, names)


def _is_of_volumes(metric: str) -> bool:
    from matbench import scoring

    return scoring.of_volumes(metric)


@app.command(name="list", help_epilogue="")
def list_(
    *,
    data: Data = None,
    plugin: Plugins = [],  # noqa: B006 -- never changed
    as_json: Annotated[bool, Parameter(name="--json", negative="", help="Machine-readable.")] = False,
) -> int:
    """Show algorithms with their parameters, scenes with their sizes, and metrics.

    **Examples**

    `matbench list`

    `matbench list --data ~/stereo --json`
    """
    from matbench import listing

    known = listing.known(data, plugin)
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
    compare: Annotated[
        tuple[str, str] | None,
        Parameter(negative="", help="Two cells of one scene, side by side: parts of their names or keys."),
    ] = None,
    web: Annotated[bool, Parameter(negative="", help="In the browser instead of a window.")] = False,
) -> int:
    """Open the recording of a cell, or those of two cells side by side.

    **Examples**

    `matbench view runs/1a2b3c4d`

    `matbench view runs/1a2b3c4d 'materiality on synthetic/box' --web`

    `matbench view runs/1a2b3c4d --compare 'materiality on synthetic/box' 'multiview_sgm on synthetic/box'`

    Parameters
    ----------
    run
        Run folder that was written with `compare --record`, or a recording, such as of `scene show --record`.
    cell
        Part of the cell's name or key; not needed where there is only one recording.
    """
    from tempfile import TemporaryDirectory

    from matbench import recording
    from matbench.store import Store

    if compare is None:
        recording.view(run if run.suffix == ".rrd" else Store(run).recording(cell), web)
        return DONE
    if run.suffix == ".rrd" or cell is not None:
        raise UserError("--compare takes two cells of a run: matbench view RUN --compare A B")
    from matbench import side_by_side

    one, other = (Store(run).recording(part) for part in compare)
    with TemporaryDirectory(prefix="matbench-") as folder:
        path = Path(folder) / "compare.rrd"
        side_by_side.merge(path, one, other)
        recording.view(path, web)
    return DONE


app.command("matbench.commands.bench:app", name="bench", help="Measure speed: against stored ratios, or a commit.")
app.command("matbench.commands.check:app", name="check", help="Try methods: do they keep to what is asked of them?")
app.command("matbench.commands.status:app", name="status", help="Show where a run stands, also while it runs.")
app.command("matbench.commands.score:app", name="score", help="Score stored maps again: no method runs.")
app.command(
    "matbench.commands.export:app", name="export", help="Make one archive of a run: all that checks its tables."
)
app.command("matbench.commands.fetch:app", name="fetch", help="Download scenes, check them, and put them in place.")
app.command("matbench.commands.report:app", name="report", help="Write the table of a finished run for a paper.")
app.command("matbench.commands.figure:app", name="figure", help="Draw the figures of a finished run for a paper.")
app.command("matbench.commands.scene:app", name="scene", help="Look at scenes, check them, and make your own.")


def main(tokens: Sequence[str] | None = None) -> None:
    """Run the command line and exit: 0 all well, 1 something failed, 2 wrong usage, 3 a regression, 130 interrupted."""
    try:
        status = app(tokens, exit_on_error=False, print_error=False, result_action="return_value")
    except UserError as error:
        status = _refuse(str(error))
    except UnusedCliTokensError as error:
        command = " ".join(("matbench", *(error.command_chain or ())))
        extra = " ".join(error.unused_tokens or ())
        status = _refuse(f"{extra!r} belongs to no option of {command}; {command} --help lists them")
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
