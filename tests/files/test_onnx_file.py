"""ONNX files: read without a library, or refused in one line."""

from pathlib import Path, PurePosixPath

import numpy as np
import pytest
from onnx_models import block_matcher
from tools import need

from matbench.errors import UserError
from matbench.files.onnx_file import Port, read_model


def message(*fields: tuple[int, "bytes | int"]) -> bytes:
    """Fields by their numbers, as Protocol Buffers write them."""

    def number(value: int) -> bytes:
        found = bytearray()
        while value > 127:
            found.append(value & 127 | 128)
            value >>= 7
        return bytes([*found, value])

    parts = []
    for at, value in fields:
        if isinstance(value, int):
            parts.append(number(at << 3) + number(value))
        else:
            parts.append(number(at << 3 | 2) + number(len(value)) + value)
    return b"".join(parts)


def port(name: bytes, *sides: "int | bytes") -> bytes:
    shape = message(*((1, message((1, side) if isinstance(side, int) else (2, side))) for side in sides))
    return message((1, name), (2, message((1, message((1, 1), (2, shape))))))


def tensor(name: bytes, values: np.ndarray, *more: "tuple[int, bytes | int]") -> bytes:
    return message(*((1, side) for side in values.shape), (2, 1), (8, name), (9, values.astype("<f4").tobytes()), *more)


def written(path: Path, *fields: "tuple[int, bytes | int]") -> Path:
    path.write_bytes(message((1, 9), (7, message(*fields))))
    return path


def test_what_a_model_says_of_itself(tmp_path: Path) -> None:
    weights = np.arange(6).reshape(2, 3)
    found = read_model(
        written(
            tmp_path / "a.onnx",
            (11, port(b"left", 1, 3, b"height", 0)),
            (11, port(b"w", 2, 3)),
            (12, port(b"map", 1, b"h")),
            (5, tensor(b"w", weights)),
        )
    )
    assert found.inputs == (Port("left", (1, 3, None, None), 1),)
    assert str(found.inputs[0]) == "left (1x3x?x?)"
    assert found.outputs == (Port("map", (1, None), 1),)
    np.testing.assert_array_equal(found.tensors["w"], weights)
    assert found.beside == ()


def test_it_is_what_the_library_says(tmp_path: Path) -> None:
    need("onnx")
    import onnx
    from onnx import numpy_helper

    path = block_matcher(tmp_path / "net.onnx", size=(48, "width"), outputs=2)
    found, told = read_model(path), onnx.load(path)
    for mine, theirs in ((found.inputs, told.graph.input), (found.outputs, told.graph.output)):
        assert [port.name for port in mine] == [port.name for port in theirs]
        shapes = [[side.dim_value or None for side in port.type.tensor_type.shape.dim] for port in theirs]
        assert [list(port.sides or ()) for port in mine] == shapes
    (gain,) = (one for one in told.graph.initializer if one.name == "gain")
    assert found.tensors["gain"] == numpy_helper.to_array(gain)


def external(location: bytes) -> bytes:
    return tensor(b"w", np.zeros(0), (14, 1), (13, message((1, b"location"), (2, location))))


def test_files_beside_it_are_found_wherever_they_are_named(tmp_path: Path) -> None:
    inner = message((5, external(b"deep/c.bin")))  # the graph of a branch
    node = message((5, message((1, b"then"), (6, inner))), (5, message((5, external(b"b.bin")))))
    found = read_model(written(tmp_path / "a.onnx", (1, node), (5, external(b"a.bin")), (5, external(b"a.bin"))))
    assert set(found.beside) == {PurePosixPath("a.bin"), PurePosixPath("b.bin"), PurePosixPath("deep/c.bin")}


@pytest.mark.parametrize("location", [b"/etc/passwd", b"../a.bin", b"a/../../b", b"", b".", b"..\\a", b"a\0b"])
def test_files_outside_its_folder_are_refused(location: bytes, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="its weights lie outside its folder") as told:
        read_model(written(tmp_path / "a.onnx", (5, external(location))))
    assert "\n" not in str(told.value)


def deep(levels: int) -> bytes:
    found = b""
    for _ in range(levels):
        found = message((1, message((5, message((6, found))))))
    return found


DAMAGED = {
    b"": "it has no graph",
    b"\x80": "ends within a number",
    b"\xff" * 11: "a number without end",
    message((7, b"")) + b"\x3a\xff": "ends within a number",
    message((7, b"")) + b"\x3a\x7f": "ends within a field",
    message((7, 5)): "graph of a model is no message",
    b"\x07": "a field of kind 7",
    b"\x02\x00": "a field without a number",
    message((7, message((5, tensor(b"w", np.zeros(3))[:-4])))): "ends within a field",
    message((7, message((5, message((1, 3), (2, 1), (8, b"w"), (9, b"abcd")))))): "not as many as their shape says",
    message((7, message((5, message((1, 1 << 62), (1, 1 << 62), (2, 1), (8, b"w"), (9, b"")))))): "not as many",
    message((7, message((5, message((1, 0), (1, 1 << 62), (2, 1), (8, b"w"), (9, b"")))))): "a shape that no array has",
    message((7, message((5, message((1, b"\1" * 100), (2, 1), (8, b"w")))))): "too many dimensions",
    message((7, message((5, message((8, b"w"), (14, 1)))))): "which it does not name",
    message((7, deep(40))): "nested too deep",
    message((7, b"\x30\x00" * 2_000_001)): "more than 2000000 fields",
}


@pytest.mark.parametrize("data", DAMAGED, ids=list(DAMAGED.values()))
def test_a_damaged_file_is_refused_in_one_line(data: bytes, tmp_path: Path) -> None:
    path = tmp_path / "a.onnx"
    path.write_bytes(data)
    with pytest.raises(UserError, match=f"^model .* is no ONNX model, or is damaged: .*{DAMAGED[data]}") as told:
        read_model(path)
    assert "\n" not in str(told.value)


def test_what_is_no_file_is_refused_in_one_line(tmp_path: Path) -> None:
    for path, words in ((tmp_path, "is a folder"), (tmp_path / "none", "No such file")):
        with pytest.raises(UserError, match=words) as told:
            read_model(path)
        assert str(told.value).count(str(path)) == 1


def test_hidden_characters_of_names_are_not_printed(tmp_path: Path) -> None:
    found = read_model(written(tmp_path / "a.onnx", (11, port(b"\x1b[31mred\n", 1))))
    assert str(found.inputs[0]) == "red (1)"
