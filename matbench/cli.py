"""The command line: all commands of `matbench` put together. Each is imported when it is typed."""

import sys
import warnings
from collections.abc import Sequence

from cyclopts import App, CycloptsError, UnusedCliTokensError

from matbench._version import __version__
from matbench.commands import ablate, compare, streams, view
from matbench.commands.console import DONE, FAILED, INTERRUPTED, WRONG_USAGE, complain
from matbench.errors import UserError, cause, refuse_hidden
from matbench.files.own_folders import forget_relative_home
from matbench.safe_text import printable

app = App(
    name="matbench",
    help="Evaluation and benchmarking of multi-baseline stereo.",
    help_epilogue="""\
**Examples**

`matbench compare`  seven methods on twelve random worlds and the paper's three

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

for _quick in (compare, ablate, view):
    app.command(_quick.app)
# imported when they are typed; what is said here saves importing them for the list of commands
COMMANDS = {
    "maps": "Look at ready-made disparity maps before they are scored.",
    "list": "Show algorithms with their parameters, scenes with their sizes, and metrics.",
    "bench": "Measure speed: against stored ratios, or a commit.",
    "check": "Try methods: do they keep to what is asked of them?",
    "status": "Show where a run stands, also while it runs.",
    "score": "Score stored maps again: no method runs.",
    "export": "Make one archive of a run: all that checks its tables.",
    "fetch": "Download scenes, check them, and put them in place.",
    "report": "Write the table of a finished run for a paper.",
    "figure": "Draw the figures of a finished run for a paper.",
    "scene": "Look at scenes, check them, and make your own.",
}
for _name, _help in COMMANDS.items():
    app.command(f"matbench.commands.{_name}:app", name=_name, help=_help)


def main(tokens: Sequence[str] | None = None) -> None:
    """Run the command line and exit: 0 all well, 1 something failed, 2 wrong usage, 3 a regression, 130 interrupted."""
    warnings.formatwarning = _warning
    forget_relative_home()
    try:
        for one in sys.argv[1:] if tokens is None else tokens:
            if one != one.encode("utf-8", "replace").decode("utf-8"):  # a file's name in another encoding
                refuse_hidden("argument", one)
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
        complain("interrupted")
        status = INTERRUPTED
    except OSError as error:
        status = _refuse(f"{error.filename}: {cause(error)}" if error.filename else cause(error))
    if why := streams.fault():
        complain(f"standard output could not be written: {why}")
        status = status or (DONE if streams.is_spare() else FAILED)
    sys.exit(status)


def _warning(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    line: str | None = None,  # noqa: ARG001 -- the standard library gives it
) -> str:
    """A warning in one line; what the harness says to users goes without a line of its code."""
    message = str(message).strip().partition("\n")[0]  # numba adds a traceback where a variable is no number
    place = "" if category is UserWarning else f"{filename}:{lineno}: {category.__name__}: "
    return f"matbench: {place}{printable(str(message))}\n"


def _refuse(message: str) -> int:
    complain(message)
    return WRONG_USAGE
