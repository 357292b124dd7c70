"""ONNX files that are not trusted: what they take and give, the files beside them, and their weights.

An ONNX file is a message of Protocol Buffers: fields, each a number, a kind, and a value or a length and so many bytes.
What is asked of it here is little, so it is read without any library, and nothing in it is run.

Reference: https://github.com/onnx/onnx/blob/main/onnx/onnx.proto.
"""

from collections.abc import Iterator, Mapping
from math import prod
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from matbench.errors import UserError, cause
from matbench.files.plain import NotPlain, read_plain
from matbench.safe_text import one_line

LARGEST = 1 << 31
"""Most bytes of a model: of Protocol Buffers themselves. What is larger has its weights in other files."""
_MOST_FIELDS, _DEEPEST = 2_000_000, 64
_MOST_NAME = 200  # characters of a name that is shown
_FLOAT = 1  # elements of a tensor

# message -> number of a field -> name, and the message that it holds ("" for a text, None for a number or bytes)
_FORM: Mapping[str, Mapping[int, tuple[str, str | None]]] = {
    "model": {1: ("version", None), 7: ("graph", "graph"), 20: ("training", "training"), 25: ("function", "function")},
    "training": {1: ("graph", "graph"), 2: ("graph", "graph")},
    "function": {7: ("node", "node"), 11: ("attribute", "attribute")},
    "graph": {
        1: ("node", "node"),
        5: ("tensor", "tensor"),
        11: ("input", "port"),
        12: ("output", "port"),
        15: ("sparse", "sparse"),
    },
    "node": {5: ("attribute", "attribute")},
    "attribute": {
        5: ("tensor", "tensor"),
        6: ("graph", "graph"),
        10: ("tensor", "tensor"),
        11: ("graph", "graph"),
        22: ("sparse", "sparse"),
        23: ("sparse", "sparse"),
    },
    "sparse": {1: ("tensor", "tensor"), 2: ("tensor", "tensor")},
    "tensor": {
        1: ("dims", None),
        2: ("kind", None),
        8: ("name", ""),
        9: ("raw", None),
        13: ("external", "entry"),
        14: ("location", None),
    },
    "entry": {1: ("key", ""), 2: ("value", "")},
    "port": {1: ("name", ""), 2: ("type", "type")},
    "type": {1: ("tensor", "array")},
    "array": {1: ("kind", None), 2: ("shape", "shape")},
    "shape": {1: ("side", "side")},
    "side": {1: ("size", None), 2: ("name", "")},
}


class _Damaged(Exception):
    """What is wrong with a file, in words."""


@frozen
class Port:
    """An input or an output of a model.

    Parameters
    ----------
    sides
        Its shape: a number, or None for a side that may have any length; None if the file does not say.
    kind
        The type of its elements, by the number that ONNX has for it: 1 is float32.
    """

    name: str
    sides: tuple[int | None, ...] | None
    kind: int

    def __str__(self) -> str:
        shape = "?" if self.sides is None else "x".join("?" if side is None else str(side) for side in self.sides)
        return f"{one_line(self.name)[:_MOST_NAME]} ({shape})"


@frozen(eq=False)
class Model:
    """What an ONNX file says of itself.

    Parameters
    ----------
    inputs, outputs
        In their order. Weights that are listed as inputs, too, are left out.
    beside
        Paths of further files that hold weights, relative to the model's folder.
    tensors
        Name -> the weights that are float32 and stand in the file itself.
    """

    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    beside: tuple[PurePosixPath, ...]
    tensors: Mapping[str, NDArray[np.float32]]


def read_model(path: Path) -> Model:
    """Read what an ONNX file says of itself.

    Raises
    ------
    UserError
        If it is missing or no ONNX model, if it is damaged, or if it names files outside its folder.
    """
    try:
        data = read_plain(path, most=LARGEST)
    except NotPlain as error:
        raise UserError(f"model {path} {str(error).removeprefix(f'{path.name} ')}") from None
    except OSError as error:
        raise UserError(f"model {path} cannot be read: {cause(error)}") from None
    try:
        return _Reading(data).model()
    except _Damaged as wrong:
        raise UserError(f"model {path} is no ONNX model, or is damaged: {wrong}") from None


class _Reading:
    """One file while it is read."""

    def __init__(self, data: bytes) -> None:
        self.data, self.count = memoryview(data), 0

    def model(self) -> Model:
        ports: dict[str, list[Port]] = {"input": [], "output": []}
        tensors: dict[str, dict[str, Any]] = {}
        beside: dict[PurePosixPath, None] = {}
        found = False
        for trail, name, value in self._every("model", self.data, ()):
            if name == "graph" and not trail:
                found = True
            elif name in ports and trail == ("graph",):
                ports[name].append(self._port(value))
            elif name == "tensor":
                tensor = self._tensor(value)
                if tensor["external"]:
                    beside[self._location(tensor["external"])] = None
                elif trail == ("graph",) and tensor["name"]:
                    tensors[tensor["name"]] = tensor
        if not found:
            raise _Damaged("it has no graph")
        weights = {name: one for name, one in tensors.items() if one["kind"] == _FLOAT and one["raw"] is not None}
        inputs = tuple(port for port in ports["input"] if port.name not in tensors)
        return Model(inputs, tuple(ports["output"]), tuple(beside), {n: self._floats(n, t) for n, t in weights.items()})

    def _every(self, form: str, data: memoryview, trail: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], str, Any]]:
        """Every field of a message and of those in it, with the names of the messages that it is in."""
        if len(trail) > _DEEPEST:
            raise _Damaged("it is nested too deep")
        for name, inner, value in self._fields(form, data):
            yield trail, name, value
            if inner in ("graph", "training", "function", "node", "attribute", "sparse"):
                yield from self._every(inner, value, (*trail, name))

    def _fields(self, form: str, data: memoryview) -> Iterator[tuple[str, str | None, Any]]:
        """Name, the message it holds, and value of each field that is known in a message."""
        known, at, end = _FORM[form], 0, len(data)
        while at < end:
            self.count += 1
            if self.count > _MOST_FIELDS:
                raise _Damaged(f"it has more than {_MOST_FIELDS} fields")
            tag, at = _number(data, at)
            number, wire = tag >> 3, tag & 7
            value: Any
            if wire == 0:
                value, at = _number(data, at)
            elif wire in (1, 5):
                size = 8 if wire == 1 else 4
                value, at = data[at : at + size], at + size
            elif wire == 2:
                size, at = _number(data, at)
                value, at = data[at : at + size], at + size
            else:
                raise _Damaged(f"a field of kind {wire} at byte {at}")
            if at > end or number == 0:
                raise _Damaged("it ends within a field" if at > end else "a field without a number")
            if number in known:
                name, inner = known[number]
                if inner is not None and wire != 2:
                    raise _Damaged(f"{name} of a {form} is no message")
                yield name, inner, bytes(value).decode("utf-8", "replace") if inner == "" else value

    def _port(self, data: memoryview) -> Port:
        name, sides, kind = "", None, 0
        for field, _, value in self._fields("port", data):
            if field == "name":
                name = value
                continue
            for what, _, array in self._fields("type", value):
                for part, _, inside in self._fields("array", array) if what == "tensor" else ():
                    if part == "kind":
                        kind = _whole(inside)
                    else:
                        sides = tuple(self._side(side) for _, _, side in self._fields("shape", inside))
        return Port(name, sides, kind)

    def _side(self, data: memoryview) -> int | None:
        """The length of a side; None where it has a name, no length, or one that is no length."""
        for name, _, value in self._fields("side", data):
            if name == "size" and 0 < _whole(value) < 1 << 63:
                return _whole(value)
        return None

    def _tensor(self, data: memoryview) -> dict[str, Any]:
        found: dict[str, Any] = {"dims": [], "kind": 0, "name": "", "raw": None, "external": [], "location": 0}
        for name, _, value in self._fields("tensor", data):
            if name == "dims":
                found["dims"] += [value] if isinstance(value, int) else list(_packed(value[: 10 * _DEEPEST]))
                if len(found["dims"]) > _DEEPEST:
                    raise _Damaged("a tensor of too many dimensions")
            elif name == "external":
                found["external"].append(value)
            else:
                found[name] = value
        if found["location"] and not found["external"]:
            raise _Damaged(f"the weights {found['name'][:_MOST_NAME]!r} lie in another file, which it does not name")
        return found

    def _location(self, entries: list[memoryview]) -> PurePosixPath:
        """The file that holds a tensor. It must lie below the model's folder: what is not named is not digested."""
        told: dict[str, str] = {}
        for entry in entries:
            fields = {name: value for name, _, value in self._fields("entry", entry)}
            told[fields.get("key", "")] = fields.get("value", "")
        place = PurePosixPath(told.get("location", ""))
        text = str(place)
        if (
            place.is_absolute()
            or ".." in place.parts
            or text == "."
            or "\\" in text
            or "\0" in text
            or len(text) > 4096
        ):
            raise _Damaged(f"its weights lie outside its folder, in {one_line(text)[:_MOST_NAME]!r}")
        return place

    def _floats(self, name: str, tensor: dict[str, Any]) -> NDArray[np.float32]:
        dims, raw = tensor["dims"], tensor["raw"]
        if isinstance(raw, int) or 4 * prod(dims) != len(raw):
            raise _Damaged(f"the weights {name[:_MOST_NAME]!r} are not as many as their shape says")
        try:
            return np.frombuffer(raw, "<f4").reshape(dims)
        except (ValueError, OverflowError):  # a side of 0 beside others that no array has, or too many sides
            raise _Damaged(f"the weights {name[:_MOST_NAME]!r} have a shape that no array has") from None


def _number(data: memoryview, at: int) -> tuple[int, int]:
    """The number that begins there, seven bits a byte, and where it ends."""
    found = 0
    for place in range(10):
        if at + place >= len(data):
            raise _Damaged("it ends within a number")
        byte = data[at + place]
        found |= (byte & 127) << (7 * place)
        if byte < 128:
            return found, at + place + 1
    raise _Damaged(f"a number without end at byte {at}")


def _whole(value: Any) -> int:
    if not isinstance(value, int):
        raise _Damaged("a number is expected where there is none")
    return value


def _packed(data: memoryview) -> Iterator[int]:
    at = 0
    while at < len(data):
        value, at = _number(data, at)
        yield value
