"""Errors that a user can put right."""

from collections.abc import Iterable
from difflib import get_close_matches


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
    """
    names = sorted(possible)
    near = get_close_matches(value, names, n=1)
    hint = f"did you mean {near[0]!r}? " if near else ""
    noun, blank, of_what = kind.partition(" ")
    return UserError(f"unknown {noun} {value!r}{blank}{of_what}: {hint}Possible: {', '.join(names) or 'none'}")
