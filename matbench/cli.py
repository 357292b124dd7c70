"""The command line: all commands of `matbench`. Heavy imports happen where they are used."""

import json
import os
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from attrs import field, frozen
from cyclopts import App, CycloptsError, Parameter
from rich import console as rich_console

from matbench._version import __version__
from matbench.errors import UserError
from matbench.settings import Settings


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

`matbench list`  methods with their parameters, scenes, metrics

`matbench fetch paper`  download the paper's three scenes

`matbench view runs/1a2b3c4d`  open a recording

`matbench scene check my_scene`  a scene of your own, a folder: is it what it says?
""",
    help_format="markdown",
    version=__version__,
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
    record: Annotated[bool, Parameter(negative="", help="Also write a recording of every cell for `view`.")] = False,
    row: Annotated[str | None, Parameter(help="Image row of the recordings' slices; default the middle one.")] = None,
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

    Scores of volumes, which are kept; and of predictions of the rightmost view, which is not given:

    `matbench compare -a materiality -s synthetic/box -m surface_f_1`

    `matbench compare -s 'synthetic/*[predict=right]' -m prediction_psnr`
    """
    from matbench import comparison
    from matbench.commands import running

    _check_metric(options.metric)
    if row is not None and not record:
        raise UserError(f"--row {row} chooses what recordings show: add --record")
    if scene is None:
        running.say_missing(comparison.default_scenes(options.data)[1], options.data)
    ready = comparison.prepare(
        algorithm,
        scene,
        settings=Settings(
            options.data, record, None if row is None else _whole("row", row), volumes or _is_of_volumes(options.metric)
        ),
        out=options.out,
        seed=options.seeds,
        plugin=options.plugin,
    )
    return running.work(ready, options.metric)


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

    _check_metric(options.metric)
    algorithms: list[str] = [selector]
    if selector.endswith(".toml"):
        algorithms, listed = comparison.read_request(Path(selector))
        scene = scene or listed
    chosen = methods(algorithms, options.plugin)
    ablation.check_varies(chosen, scene or ())
    ready = comparison.prepare(
        algorithms,
        scene,
        settings=Settings(options.data, volumes=_is_of_volumes(options.metric)),
        out=options.out,
        seed=options.seeds,
        plugin=options.plugin,
    )
    return running.work(ready, options.metric, is_ablation=any(ablation.factors(chosen).values()))


def _whole(name: str, text: str) -> int:
    """A number as typed; one that is not whole is refused, not rounded."""
    if not re.fullmatch(r"[0-9]{1,9}", text):
        raise UserError(f"{name} {text!r} is not a whole number from 0 to 999999999")
    return int(text)


def _check_metric(metric: str) -> None:
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


app.command("matbench.commands.bench:app", name="bench", help="Measure speed: against stored ratios, or a commit.")
app.command("matbench.commands.check:app", name="check", help="Try methods: do they keep to what is asked of them?")
app.command("matbench.commands.fetch:app", name="fetch", help="Download scenes, check them, and put them in place.")
app.command("matbench.commands.scene:app", name="scene", help="Look at scenes, check them, and make your own.")


def main(tokens: Sequence[str] | None = None) -> None:
    """Run the command line and exit: 0 all well, 1 something failed, 2 wrong usage, 130 interrupted."""
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
