"""Validators that several methods' parameters share; each raises a ValueError that says what is possible."""

from typing import Any


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
