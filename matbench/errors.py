"""The one kind of error that a user can put right, and what any other error says, in one line."""

import sysconfig
import traceback
from collections.abc import Iterable
from difflib import get_close_matches
from errno import EDQUOT, EMFILE, ENOENT
from pathlib import Path
from subprocess import CalledProcessError

from matbench import safe_text

_HARNESS = Path(__file__).parent
_METHODS = _HARNESS / "algorithms"
_LIBRARIES = {Path(sysconfig.get_path(name)) for name in ("stdlib", "platstdlib", "purelib", "platlib")}
_MOST = 2000  # characters of a message: tables and pages show it, the log has all of it
_INSTALLED = {"site-packages", "dist-packages"}


class UserError(Exception):
    """Something a user can put right, told in one line without a traceback.

    The message names the thing, the value and what would have been right.
    """


def unknown(kind: str, value: str, possible: Iterable[str]) -> UserError:
    """The error for a name that does not exist. Its message has the nearest name and all possible names.

    Parameters
    ----------
    kind
        What the name should be: a noun, or a noun and what it belongs to, such as ``option of synthetic/box``.
    value
        The name as it was typed.

    >>> str(unknown("algorithm", "sgmb", ["sgbm", "okutomi_kanade"]))
    "unknown algorithm 'sgmb': did you mean 'sgbm'? Possible: okutomi_kanade, sgbm"
    >>> str(unknown("preset of sgbm", "best", []))
    "unknown preset 'best' of sgbm: Possible: none"
    >>> str(unknown("metric", "D1", ["a1", "d1"]))
    "unknown metric 'D1': did you mean 'd1'? Possible: a1, d1"
    """
    names = sorted(possible)
    # a name in other letters first: `D1` is `d1`, however little a pair of them has in common
    near = [name for name in names if name.casefold() == value.casefold()] or get_close_matches(value, names, n=1)
    hint = f"did you mean {near[0]!r}? " if near else ""
    noun, blank, of_what = kind.partition(" ")
    return UserError(f"unknown {noun} {value!r}{blank}{of_what}: {hint}Possible: {', '.join(names) or 'none'}")


LONGEST_NAME = 4096
"""Characters of a name, as many as a path may have. Setting a name of 100,000 in tables and figures takes a minute."""


def refuse_hidden(what: str, text: str) -> None:
    r"""Raise UserError where a name, or a value that becomes part of one, has no end, or holds what nobody can see.

    All names go through here: of methods, scenes, views, regions and metrics, parameters and options with their
    values, plug-in files and run folders. So what is accepted can be printed, stored, and read back as it was.

    >>> refuse_hidden("output folder", "runs/first")
    >>> refuse_hidden("output folder", "runs/a\tb")
    Traceback (most recent call last):
        ...
    matbench.errors.UserError: output folder 'runs/a\tb' holds a tab: names may hold only what can be seen
    """
    if len(text) > LONGEST_NAME:
        raise UserError(f"{what} has {len(text)} characters: names may have {LONGEST_NAME}")
    if found := safe_text.hidden_in(text):
        raise UserError(f"{what} '{safe_text.printable(text)}' holds {found}: names may hold only what can be seen")


def one_line(error: BaseException) -> str:
    """All that an exception says, in one line; its type where it says nothing. Of a very long one its two ends.

    It is ``str(error)``, not the first argument: that of an `OSError` is a number, that of a
    `UnicodeDecodeError` the name of a codec. Of a program that was called, the last line that it printed as an
    error is told, too, where it was caught.

    >>> one_line(FileNotFoundError(2, "No such file or directory", "left.png"))
    "[Errno 2] No such file or directory: 'left.png'"
    >>> one_line(ValueError("two\\nlines"))
    'two lines'
    >>> one_line(AssertionError())
    'AssertionError'
    """
    # unlike str(), it never raises, whatever a method's own exception does
    said = str(traceback.TracebackException(type(error), error, None, lookup_lines=False))
    if isinstance(error, CalledProcessError) and error.stderr:
        printed = error.stderr if isinstance(error.stderr, str) else error.stderr.decode("utf-8", "replace")
        said += f" It printed: {(printed.splitlines() or [''])[-1]}"
    words = safe_text.one_line(said)
    if len(words) > _MOST:
        ends = words[: _MOST // 2], words[-_MOST // 2 :]
        words = f" ... {len(words) - _MOST} characters left out ... ".join(ends)
    return words or type(error).__name__


def cause(error: OSError) -> str:
    """What the system refused, in words, and what to do where the system's words do not tell.

    >>> cause(OSError(28, "No space left on device"))
    'No space left on device'
    >>> cause(OSError(24, "Too many open files"))
    'Too many open files: raise their number with ulimit -n'
    """
    if error.errno == ENOENT and not _has_working_folder():
        return "the working folder has been deleted: change into another one"
    said = error.strerror or one_line(error)
    hint = {EMFILE: "raise their number with ulimit -n", EDQUOT: "remove some of your files"}.get(error.errno or 0)
    return f"{said}: {hint}" if hint else said


def _has_working_folder() -> bool:
    try:
        Path.cwd()
    except FileNotFoundError:
        return False
    return True


def where(error: BaseException) -> str:
    """``file.py:12``: the line of the user's code in which an exception was raised or which led to it.

    It is the last one that belongs neither to the harness nor to an installed library; empty if there is none.
    Built-in methods are no part of the harness here.
    """
    lines = [(Path(one.filename), one.lineno) for one in traceback.extract_tb(error.__traceback__)]
    own = [(path, line) for path, line in lines if not (_is_harness(path) or _is_library(path))]
    return f"{own[-1][0].name}:{own[-1][1]}" if own else ""


def failure(error: BaseException) -> str:
    """An exception's type, all that it says and where it came from, in one line; a `UserError` says enough."""
    said, kind, place = one_line(error), type(error).__name__, where(error)
    if isinstance(error, UserError):
        return said
    return (said if said == kind else f"{kind}: {said}") + (f" ({place})" if place else "")


def _is_harness(path: Path) -> bool:
    return path.is_relative_to(_HARNESS) and not path.is_relative_to(_METHODS)


def _is_library(path: Path) -> bool:
    """Is it a file of Python's own library, or of an installed distribution other than this one?"""
    if path.is_relative_to(_HARNESS):
        return False
    is_installed = bool(_INSTALLED.intersection(path.parts)) or any(map(path.is_relative_to, _LIBRARIES))
    return is_installed or path.name.startswith("<")  # "<frozen importlib._bootstrap>"
