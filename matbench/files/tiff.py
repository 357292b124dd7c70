"""TIFF files that are not trusted: what they claim is looked at before anything is unpacked."""

import struct

import numpy as np
from numpy.typing import NDArray

_VERSIONS = {42: ("I", 4, "H"), 43: ("Q", 8, "Q")}
"""Version -> type of its offsets, where the first one stands, and type of the number of entries."""
_WIDTH, _HEIGHT, _SIDES = 256, 257, {3: "H", 4: "I", 16: "Q"}  # tags; how their numbers are stored
_MOST_ENTRIES = 4096  # that libtiff reads


def is_tiff(data: bytes) -> bool:
    return data[:2] in (b"II", b"MM") and data[2:4] in (b"*\0", b"\0*", b"+\0", b"\0+")


def size(data: bytes) -> tuple[int, int] | None:
    """(height, width) that a TIFF claims, before it is unpacked; None if it is none.

    OpenCV looks at what is in a file, not at its name: it would unpack any other picture, too.
    """

    def at(kind: str, place: int) -> int:
        return int(struct.unpack_from(order + kind, data, place)[0])

    order = {b"II": "<", b"MM": ">"}.get(data[:2], "")
    try:
        number, first, count = _VERSIONS[at("H", 2)]
        place, short = at(number, first), struct.calcsize(number)
        begin, entry, entries = place + struct.calcsize(count), 4 + 2 * short, at(count, place)
        sides = {_WIDTH: 0, _HEIGHT: 0}
        for start in range(begin, begin + entry * min(entries, _MOST_ENTRIES), entry):
            if (tag := at("H", start)) in sides:
                sides[tag] = max(sides[tag], at(_SIDES[at("H", start + 2)], start + entry - short))
    except (struct.error, KeyError, OverflowError):
        return None
    return (sides[_HEIGHT], sides[_WIDTH]) if order and entries <= _MOST_ENTRIES else None


def decode(data: bytes) -> NDArray[np.generic] | None:
    """What a TIFF holds, (H, W) or (H, W, channels) with blue first; None if it cannot be read.

    Its claimed `size` must have been looked at.
    """
    import cv2

    level = cv2.utils.logging.getLogLevel()
    cv2.utils.logging.setLogLevel(0)  # what is wrong is told by our own error
    try:
        found = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        found = None
    finally:
        cv2.utils.logging.setLogLevel(level)
    return None if found is None else np.asarray(found)
