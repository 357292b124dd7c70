"""Families of metrics that differ by a number in their name, such as ``bad_3`` and ``bad_0.07``."""

import re
from collections.abc import Callable
from typing import Any

from attrs import field, frozen

from matbench.errors import UserError, failure

AT = "@"
"""Stands for the number in a family's name."""

_NUMBER = r"(\d{1,9}(?:\.\d{1,9})?)"
_DIGITS = 6


def _holds_one(_: object, __: object, name: str) -> None:
    if name.count(AT) != 1:
        raise ValueError(f"family {name!r}: {AT} must stand once in its name, where the number does")


@frozen
class Family:
    """Metrics that differ by a number in their name.

    Parameters
    ----------
    name
        The names of its metrics, with `AT` in place of the number: ``bad_@``.
    about
        A description in one line, with `AT` in place of the number.
    make
        Number -> its metric; the metric's name must be the family's, with the number as ``f"{number:g}"`` writes it.
    least, most
        The numbers that are possible, both included.
    beside
        Names of families whose metric of the same number is computed, too, wherever one of this family is asked for.
    """

    name: str = field(validator=_holds_one)
    about: str
    make: Callable[[float], Any]
    least: float
    most: float
    beside: tuple[str, ...] = ()

    def number(self, name: str) -> str | None:
        """The number in a metric's name, as it is written there; None if the name is none of this family.

        >>> Family("bad_@", "", lambda number: None, 0, 1).number("bad_0.07")
        '0.07'
        """
        before, _, after = self.name.partition(AT)
        found = re.fullmatch(re.escape(before) + _NUMBER + re.escape(after), name, re.ASCII)
        return found[1] if found else None

    def named(self, name: str) -> Any:
        """The metric of that name; None if the name is none of this family.

        Raises
        ------
        UserError
            If the number is not possible, or the family's own code fails.
        """
        said = self.number(name)
        if said is None:
            return None
        number = float(said)
        if not self.least <= number <= self.most or float(f"{number:.{_DIGITS}g}") != number:
            possible = f"a number from {self.least:g} to {self.most:g} of at most {_DIGITS} digits"
            raise UserError(f"metric {name}: {said} is not {possible}")
        called = self.name.replace(AT, f"{number:g}")
        try:
            made = self.make(number)
        except Exception as error:  # whatever a plug-in's own code raises
            raise UserError(f"metric {called}: {failure(error)}") from error
        if getattr(made, "name", None) != called:
            raise UserError(
                f"metric {called}: family {self.name} made one called {getattr(made, 'name', made)!r} for it"
            )
        return made
