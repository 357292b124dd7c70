"""The one kind of error that is the user's to mend."""

from collections.abc import Iterable
from difflib import get_close_matches


class UserError(Exception):
    """Something a user can put right, told in one line without a traceback.

    The message names the thing, the value and what would have been right.
    """


def unknown(kind: str, value: str, possible: Iterable[str]) -> UserError:
    """The error for a name that does not exist: `kind` and `value`, the nearest name, all names.

    >>> str(unknown("algorithm", "sgmb", ["sgbm", "okutomi_kanade"]))
    "unknown algorithm 'sgmb': did you mean 'sgbm'? Possible: okutomi_kanade, sgbm"
    """
    names = sorted(possible)
    near = get_close_matches(value, names, n=1)
    hint = f"did you mean {near[0]!r}? " if near else ""
    return UserError(f"unknown {kind} {value!r}: {hint}Possible: {', '.join(names) or 'none'}")
