"""What a recording is to hold, as the option ``--record slices,volumes,passes=10`` chooses it."""

import re
from collections.abc import Iterable
from typing import ClassVar

from attrs import evolve, field, frozen

from matbench.errors import UserError, unknown

MOST_PASSES, MOST_ROWS = 200, 12


def _rows(rows: Iterable[int]) -> tuple[int, ...]:
    return tuple(rows)


@frozen
class RecordOption:
    """What to record besides views, regions, maps, errors and energies, which are always recorded.

    Parameters
    ----------
    slices
        Epipolar slices of similarity, visibility, materiality and derivative.
    volumes
        Volumes of similarity, visibility and materiality.
    space
        The answer or the materialities in disparity space, with its planes and rays.
    surface
        The answer as points in perspective.
    passes
        The most passes whose slices and maps are kept; 0 keeps none.
    rows
        The image rows whose epipolar planes are shown; none means the middle one.
    """

    PARTS: ClassVar[tuple[str, ...]] = ("slices", "volumes", "space", "surface")

    slices: bool = True
    volumes: bool = True
    space: bool = True
    surface: bool = True
    passes: int = 20
    rows: tuple[int, ...] = field(default=(), converter=_rows)

    @classmethod
    def of(cls, parts: Iterable[str] = (), rows: str | None = None) -> "RecordOption":
        """Read what was typed; without any parts, all are chosen.

        >>> RecordOption.of(["slices,passes=10"], "144,10").rows
        (10, 144)

        Raises
        ------
        UserError
            For a part or a row that does not exist.
        """
        named = [part for one in parts for part in one.split(",") if part]
        chosen: dict[str, bool | int] = dict.fromkeys(cls.PARTS, not named) | ({"passes": 0} if named else {})
        for part in named:
            name, equals, count = part.partition("=")
            if name == "passes":
                chosen["passes"] = _whole("passes", count, MOST_PASSES) if equals else cls().passes
            elif name == "all" and not equals:
                chosen |= dict.fromkeys(cls.PARTS, True) | {"passes": cls().passes}
            elif part in cls.PARTS:
                chosen[part] = True
            else:
                raise unknown("part of a recording", part, [*cls.PARTS, "passes=N", "all"])
        wanted = [_whole("row", row) for row in rows.split(",")] if rows is not None else []
        if len(wanted) > MOST_ROWS:
            raise UserError(f"{len(wanted)} rows: a recording shows {MOST_ROWS} at most")
        return cls(**chosen, rows=sorted(set(wanted)))  # type: ignore[arg-type]  # names and types are those above

    def at(self, height: int) -> "RecordOption":
        """The same choice for a scene `height` rows high: the middle row if none was named.

        Raises
        ------
        ValueError
            If the scene lacks one of the rows.
        """
        for row in self.rows:
            if not 0 <= row < height:
                raise ValueError(f"row {row} is not one of 0..{height - 1}")
        return self if self.rows else evolve(self, rows=(height // 2,))

    def covers(self, other: "RecordOption") -> bool:
        """Does a recording made by this choice hold everything that `other` asks for?"""
        has_parts = all(getattr(self, part) or not getattr(other, part) for part in self.PARTS)
        return has_parts and self.passes >= other.passes and set(other.rows) <= set(self.rows)


Recording = RecordOption
"""Its old name, which scripts pass to `matbench.compare`."""


def _whole(name: str, text: str, most: int = 999_999_999) -> int:
    if not re.fullmatch(r"[0-9]{1,9}", text) or int(text) > most:
        raise UserError(f"{name} {text!r} is not a whole number from 0 to {most}")
    return int(text)
