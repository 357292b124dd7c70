"""A scene as bytes and back, to the bit: what `matbench.scenes.kept` writes.

The bytes are a SHA-256 over all that follows, a line of JSON, and then the arrays as they lie in memory: truth, views,
and the masks of regions and visibilities, eight pixels a byte.
"""

import json
from collections.abc import Sequence
from hashlib import sha256
from itertools import accumulate
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from matbench.files.documents import parse_json
from matbench.scene import Range, Scene

FORMAT = 1
"""Of the bytes; it counts up with every change of what `packed` writes."""

_SEAL = 2 * sha256().digest_size
_ALIGNED = 64  # bytes that the line of JSON is filled up to a multiple of, so that float32 lie where they may
_PLAIN = ("name", "labels", "ref", "pair_steps", "positions", "metrics", "sparse")
_Array = tuple[type[np.generic], tuple[int, ...]]
"""Type and shape."""


def packed(scene: Scene, key: str) -> bytes:
    """The bytes of a scene.

    Parameters
    ----------
    scene
        One without a view that is held out.
    key
        What it is kept as; it must be given to read them.

    Raises
    ------
    ValueError
        If a view of it is held out.
    """
    if scene.held_out is not None:
        raise ValueError(f"{scene.name}: a view is held out")
    head = {
        "key": key,
        "scene": {name: getattr(scene, name) for name in _PLAIN},
        "disparities": (scene.disparities.least, scene.disparities.largest),
        "shape": scene.views.shape,
        "truth": list(scene.truth),
        "regions": list(scene.regions),
        "visible": list(scene.visible),
    }
    line = json.dumps(head).encode() + b"\n"
    line = line.rjust(-(-(_SEAL + len(line)) // _ALIGNED) * _ALIGNED - _SEAL)
    masks = [mask.ravel() for mask in (*scene.regions.values(), *scene.visible.values())]
    bits = np.packbits(np.concatenate(masks)) if masks else np.zeros(0, np.uint8)
    arrays: list[NDArray[Any]] = [*scene.truth.values(), scene.views, bits]
    body = line + b"".join(array.tobytes() for array in arrays)
    return sha256(body).hexdigest().encode() + body


def unpacked(content: bytes, key: str) -> Scene:
    """The scene in bytes that `packed` made under the same key.

    Raises
    ------
    ValueError
        If they are anything else, also where only one bit of them has changed.
    """
    body = memoryview(content)[_SEAL:]
    if content[:_SEAL] != sha256(body).hexdigest().encode():
        raise ValueError("it is cut, or has changed")
    try:
        return _scene(content, key)
    except Exception as error:  # whatever comes of bytes that somebody else has sealed
        raise ValueError(f"it holds no scene: {error!r}") from error


def _scene(content: bytes, key: str) -> Scene:
    begin = content.index(b"\n") + 1
    head = parse_json(content[_SEAL:begin])
    if head["key"] != key:
        raise ValueError(f"it is {head['key']}, not {key}")
    n, height, width, channels = head["shape"]
    masks = [(height, width)] * len(head["regions"]) + [(n, height, width)] * len(head["visible"])
    wanted: list[_Array] = [(np.float32, (height, width)) for _ in head["truth"]]
    wanted += [(np.uint8, (n, height, width, channels)), (np.uint8, (-(-sum(map(prod, masks)) // 8),))]
    *truth, views, bits = _arrays(content, begin, wanted)
    known = _masks(bits, masks)
    told, regions = head["scene"], len(head["regions"])
    return Scene(
        **{**told, "labels": tuple(told["labels"])},
        # in memory of their own: whoever has the views must not reach the truth beside them
        views=np.frombuffer(views.tobytes(), np.uint8).reshape(views.shape),
        disparities=Range(*head["disparities"]),
        truth=dict(zip(head["truth"], truth, strict=True)),
        regions=dict(zip(head["regions"], known[:regions], strict=True)),
        visible=dict(zip(head["visible"], known[regions:], strict=True)),
    )


def _arrays(content: bytes, begin: int, wanted: Sequence[_Array]) -> list[NDArray[Any]]:
    """Arrays of these types and shapes, one after the other, which are all that follows."""
    found = []
    for kind, shape in wanted:
        found.append(np.frombuffer(content, kind, prod(shape), begin).reshape(shape))
        begin += found[-1].nbytes
    if begin != len(content):
        raise ValueError(f"{len(content) - begin} bytes follow")
    return found


def _masks(bits: NDArray[np.uint8], shapes: Sequence[tuple[int, ...]]) -> list[NDArray[np.bool_]]:
    """Masks of these shapes, one after the other."""
    sizes = [prod(shape) for shape in shapes]
    every = np.unpackbits(bits, count=sum(sizes)).view(np.bool_)
    every.setflags(write=False)  # or a scene would copy each
    ends = list(accumulate(sizes))
    return [every[end - size : end].reshape(shape) for end, size, shape in zip(ends, sizes, shapes, strict=True)]
