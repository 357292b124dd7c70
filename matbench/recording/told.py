"""What a method told and answered, on its way from the process that ran it to the one that knows the truth.

One ``.npz``: numbers and texts as JSON, arrays beside it. It comes from a process that a method may have spoilt, so
nothing in it is executed, and whatever does not have the right types is refused.
"""

import json
from pathlib import Path
from typing import Any, get_origin

import numpy as np
from attrs import frozen
from cattrs.preconf.json import make_converter
from numpy.typing import NDArray

from matbench.algorithm import Estimate
from matbench.files.arrays import opened_arrays
from matbench.files.documents import parse_json
from matbench.recording.probe import CapturingProbe

_MOST_BYTES = 1 << 32  # of all arrays, unpacked
_FACTS = "facts"


@frozen(eq=False)
class Told:
    """What a recording is made from, besides its scene."""

    probe: CapturingProbe
    estimate: Estimate


def write_told(path: Path, told: Told) -> None:
    """Write what was told to a new file."""
    arrays: dict[str, NDArray[Any]] = {}

    def aside(array: NDArray[Any]) -> str:
        name = f"array_{len(arrays)}"
        arrays[name] = np.asarray(array)
        return name

    converter = make_converter()
    converter.register_unstructure_hook(np.ndarray, aside)
    converter.register_unstructure_hook_func(_is_array, aside)
    facts = json.dumps(converter.unstructure(told))
    np.savez(path, **{_FACTS: np.array(facts)}, **arrays)  # type: ignore[arg-type]  # names are those above


def read_told(path: Path) -> Told:
    """What `write_told` wrote.

    Raises
    ------
    ValueError
        If the file holds something else.
    """
    try:
        with opened_arrays(path, follow=False) as arrays:
            if arrays.bytes > _MOST_BYTES:
                raise ValueError(f"it unpacks to more than {_MOST_BYTES} bytes")
            converter = make_converter()
            converter.register_structure_hook_func(_is_array, lambda name, _: arrays.read(str(name)))
            return converter.structure(parse_json(str(arrays.read(_FACTS)).encode()), Told)
    except Exception as error:  # whatever damaged archives, arrays and JSON raise
        raise ValueError(f"what the method told cannot be read: {error}") from error


def _is_array(kind: Any) -> bool:
    return kind is np.ndarray or get_origin(kind) is np.ndarray
