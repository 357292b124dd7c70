"""Arrays that are used again: the system fills memory that it hands out with zeros, and that takes time."""

from collections.abc import Iterator
from contextlib import contextmanager
from math import prod
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray


class Room:
    """Arrays by name. What is asked for again by the same name lies in the same memory, whatever is in it."""

    def __init__(self) -> None:
        self._memory: dict[str, NDArray[np.uint8]] = {}
        self._idle: list[Room] = []

    def empty(self, name: str, shape: tuple[int, ...], kind: DTypeLike) -> NDArray[Any]:
        """An array of that shape and type, with anything in it; what had the name before may be overwritten."""
        size = prod(shape) * np.dtype(kind).itemsize
        found = self._memory.get(name)
        if found is None or found.size < size:
            self._memory.pop(name, None)  # freed before there is another one
            found = self._memory[name] = np.empty(size, np.uint8)
        return found[:size].view(kind).reshape(shape)

    @contextmanager
    def lent(self) -> Iterator["Room"]:
        """A room for one of several threads, for as long as it works there; the next one gets the same."""
        try:
            one = self._idle.pop()
        except IndexError:
            one = Room()
        try:
            yield one
        finally:
            self._idle.append(one)
