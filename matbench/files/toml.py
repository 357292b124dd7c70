"""TOML files that people write: whole, or refused in one line."""

from pathlib import Path
from typing import Any

from matbench.errors import UserError, cause, one_line
from matbench.files import documents
from matbench.files.plain import NotPlain, open_plain

LARGEST = 1 << 20
"""Most bytes of a file."""


def read_toml(path: Path, what: str) -> dict[str, Any]:
    """What a file holds.

    Parameters
    ----------
    what
        What the file is, for messages.

    Raises
    ------
    UserError
        If it is missing, too large, no file, or no TOML.
    """
    try:
        return documents.read_toml(path, most=LARGEST)
    except FileNotFoundError:
        raise UserError(f"{what} {path} is missing") from None
    except NotPlain as error:
        raise UserError(f"{what} {path} cannot be read: {error}") from None
    except OSError as error:
        raise UserError(f"{what} {path} cannot be read: {cause(error)}") from None
    except ValueError as error:
        if (why := _disguise(path)) is not None:
            raise UserError(f"{path} {why}") from None
        raise UserError(f"{path} is not TOML: {one_line(error)}") from None


def _disguise(path: Path) -> str | None:
    """What an editor did to a text file that is TOML otherwise, in words; None if that is not it."""
    try:
        with open_plain(path) as file:
            head = file.read(4)
    except (OSError, NotPlain):
        return None
    if head.startswith(b"\xef\xbb\xbf"):
        return "begins with a byte-order mark: TOML has none, save it as UTF-8 without one"
    if head[:2] in (b"\xff\xfe", b"\xfe\xff") or b"\0" in head:
        return "is UTF-16 (in Windows, 'Unicode'): save it as UTF-8"
    return None
