"""Validators that several methods' parameters share; each raises a ValueError that says what is possible."""

from typing import Any


def odd(_: object, attribute: Any, value: int) -> None:
    """A window's side: an odd number of pixels, at least 1."""
    if value < 1 or value % 2 == 0:
        raise ValueError(f"{attribute.name} is {value}; it must be odd and at least 1")


def all_or_several(_: object, attribute: Any, value: int) -> None:
    """A number of views: 0 for all of them, else at least 2."""
    if value < 0 or value == 1:
        raise ValueError(f"{attribute.name} is {value}; it must be 0 (all) or at least 2")
