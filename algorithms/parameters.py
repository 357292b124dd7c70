"""What several methods' parameters share: validators, whose ValueError says what is possible, and which are read."""

from collections.abc import Mapping
from typing import Any


def unread(takes: Mapping[str, tuple[bool, str]]) -> dict[str, str]:
    """Parameter -> what it needs to have an effect, for those that are not read.

    Parameters
    ----------
    takes
        Parameter -> is it read, beside the values of the others? And what it takes to be read.
    """
    return {name: condition for name, (is_read, condition) in takes.items() if not is_read}


def odd(_: object, attribute: Any, value: int) -> None:
    """A window's side: an odd number of pixels, 1 to 99."""
    if not 1 <= value <= 99 or value % 2 == 0:
        raise ValueError(f"{attribute.name} is {value}; it must be odd, 1 to 99")


def planes_a_pixel(_: object, attribute: Any, value: int) -> None:
    """Planes per pixel of view step: 0 for the method's choice, at most 64."""
    if not 0 <= value <= 64:
        raise ValueError(f"{attribute.name} is {value}; it must be 0 (automatic) to 64")


def all_or_several(_: object, attribute: Any, value: int) -> None:
    """A number of views: 0 for all of them, else at least 2."""
    if value < 0 or value == 1:
        raise ValueError(f"{attribute.name} is {value}; it must be 0 (all) or at least 2")
