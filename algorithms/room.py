"""Arrays that are used again: the system fills memory that it hands out with zeros, and that takes time."""

from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray


class Room:
    """Arrays by name. What is asked for again by the same name, shape and type is the same array, whatever is in it."""

    def __init__(self) -> None:
        self._arrays: dict[str, NDArray[Any]] = {}

    def empty(self, name: str, shape: tuple[int, ...], kind: DTypeLike) -> NDArray[Any]:
        """An array of that shape and type, with anything in it; what had the name before may be overwritten."""
        found = self._arrays.get(name)
        if found is None or found.shape != shape or found.dtype != kind:
            self._arrays.pop(name, None)  # freed before there is another one
            found = self._arrays[name] = np.empty(shape, kind)
        return found
