"""How a plan is worked through: where scenes lie, and what is kept of each cell besides its maps."""

from pathlib import Path
from typing import Literal

from attrs import field, frozen
from attrs.validators import in_

Only = Literal["missing", "failed", "all"]


@frozen
class Settings:
    """What does not decide a cell's answer, and so stands in no key.

    Parameters
    ----------
    data
        The folder of real scenes, if there is one.
    record
        Write a recording of every cell, from a second, untimed solve.
    row
        The image row that recordings show; the middle one of each scene if None.
    volumes
        Keep the volumes of the methods that have one.
    only
        Which cells: ``missing`` were never computed, ``failed`` did not end well, ``all`` again; if
        None, whatever is not done.
    """

    data: Path | None = None
    record: bool = False
    row: int | None = None
    volumes: bool = False
    only: Only | None = field(default=None, validator=in_((None, "missing", "failed", "all")))
