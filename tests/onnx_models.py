"""Small networks for two views, made of ordinary operators, whose answers are known: block matching."""

from pathlib import Path
from typing import Any

import numpy as np

PLANES = 12
WINDOW = 3


def block_matcher(
    path: Path,
    *,
    size: tuple[Any, Any] = ("height", "width"),
    colours: int = 3,
    joined: int | None = None,
    channels_last: bool = False,
    negative: bool = False,
    outputs: int = 1,
    names: tuple[str, str] = ("left", "right"),
    kind: str = "FLOAT",
    gain: float = 1.0,
    beside: str = "",
) -> Path:
    """Write a network that tells, for each pixel of the left image, the shift of the best 3x3 block in the right one.

    Its answers are 0 to 11 px; of equal ones the least. Beyond the right image's edge its first column repeats.

    Parameters
    ----------
    size
        (height, width) that it takes; a text for any.
    joined
        The axis along which one input takes both images; None for two inputs.
    negative
        Does it give the flow to the right image, which is negative, in two channels?
    outputs
        How many of its outputs are maps.
    gain
        A weight that all answers are multiplied by.
    beside
        A file that holds that weight.
    """
    from onnx import TensorProto, helper, numpy_helper, save

    number = getattr(TensorProto, kind)
    batch, deep = (2 if joined == 0 else 1), colours * (2 if joined == 1 else 1)
    shape = [batch, *size, deep] if channels_last else [batch, deep, *size]
    inputs = [helper.make_tensor_value_info(n, number, shape) for n in (names if joined is None else names[:1])]
    nodes, weights = [], {}

    def add(operator: str, given: list[str], name: str, **attributes: Any) -> str:
        nodes.append(helper.make_node(operator, given, [name], **attributes))
        return name

    def weight(name: str, value: Any, of: Any = np.int64) -> str:
        weights[name] = numpy_helper.from_array(np.array(value, of), name)
        return name

    given = [port.name for port in inputs]
    given = [add("Cast", [name], f"{name}_float", to=TensorProto.FLOAT) for name in given]
    if channels_last:
        given = [add("Transpose", [name], f"{name}_planar", perm=[0, 3, 1, 2]) for name in given]
    if joined is not None:
        nodes.append(helper.make_node("Split", given, ["one", "other"], axis=joined, num_outputs=2))
        given = ["one", "other"]
    left, right = given
    costs = []
    for d in range(PLANES):
        wide = add("Pad", [right, weight(f"sides{d}", [0, 0, 0, d, 0, 0, 0, 0])], f"wide{d}", mode="edge")
        # x_right = x_left - d
        end = weight(f"end{d}", [-d if d else np.iinfo(np.int64).max])
        shifted = add("Slice", [wide, weight(f"begin{d}", [0]), end, weight(f"axis{d}", [3])], f"shifted{d}")
        apart = add("Abs", [add("Sub", [left, shifted], f"gap{d}")], f"apart{d}")
        total = add("ReduceSum", [apart, weight(f"colours{d}", [1])], f"total{d}", keepdims=1)
        costs.append(
            add("AveragePool", [total], f"cost{d}", kernel_shape=[WINDOW] * 2, pads=[1] * 4, count_include_pad=0)
        )
    best = add("ArgMin", [add("Concat", costs, "volume", axis=1)], "best", axis=1, keepdims=1)
    plane = add("Cast", [best], "plane", to=TensorProto.FLOAT)
    found = add("Mul", [plane, weight("gain", gain, np.float32)], "gained")
    if negative:
        found = add("Neg", [found], "negative")
        across = add("Concat", [found, add("Abs", [found], "down")], "flow", axis=1)
        found = add("Identity", [across], "answer")
    told = [add("Identity", [found], f"disparity{n or ''}") for n in range(outputs)]
    side = 2 if negative else 1
    ports = [helper.make_tensor_value_info(n, TensorProto.FLOAT, [1, side, "rows", "columns"]) for n in told]
    graph = helper.make_graph(nodes, "blocks", inputs, ports, list(weights.values()))
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=9)
    if beside:
        from onnx.external_data_helper import set_external_data

        (tensor,) = (one for one in model.graph.initializer if one.name == "gain")
        content = np.array(gain, "<f4").tobytes()
        set_external_data(tensor, location=beside, offset=0, length=len(content))
        tensor.ClearField("raw_data")
        tensor.data_location = TensorProto.EXTERNAL
        if (path.parent / beside).resolve().parent == path.parent.resolve():
            (path.parent / beside).write_bytes(content)
        path.write_bytes(model.SerializeToString())
    else:
        save(model, path)
    return path


def slow(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """(H, W) the same of two (channels, H, W) images, block by block."""
    _, height, width = left.shape
    best, least = np.zeros((height, width)), np.full((height, width), np.inf)
    for d in range(PLANES):
        there = right[:, :, np.maximum(np.arange(width) - d, 0)]
        apart = np.abs(left.astype(np.float64) - there).sum(axis=0)
        for y, x in np.ndindex(height, width):
            cost = np.float32(apart[max(0, y - 1) : y + 2, max(0, x - 1) : x + 2].mean())
            if cost < least[y, x]:
                best[y, x], least[y, x] = d, cost
    return best
