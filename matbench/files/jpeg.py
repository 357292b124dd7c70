"""JPEG files that are not trusted: what their header claims, and whether they are whole, before anything is decoded."""

_START, _END = b"\xff\xd8", b"\xff\xd9"
_FRAMES = {*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC}
"""Markers that stand before the size of a picture; the three others define tables."""
_SCAN, _ALONE = 0xDA, {0x01, *range(0xD0, 0xD8)}
_MOST_SEGMENTS = 4096


class NotJpeg(ValueError):
    """What is no JPEG that can be read; said in words that follow the file's name."""


def is_jpeg(data: bytes) -> bool:
    return data.startswith(_START)


def size(data: bytes) -> tuple[int, int]:
    """(width, height) that the header of a JPEG file states.

    Reference: ITU-T T.81, annex B.

    Raises
    ------
    NotJpeg
        If there is no such header, or its numbers have another depth than 8 bits.
    """
    at, _ = _frame(data)
    bits, height, width = data[at], *(int.from_bytes(data[at + k : at + k + 2], "big") for k in (1, 3))
    if bits != 8:
        raise NotJpeg(f"has {bits} bits a channel: of JPEG, 8 are possible")
    return width, height


def check_whole(data: bytes) -> None:
    """Refuse a file that ends before its picture does: decoders fill the rest with grey.

    In coded data, no end of the picture can stand by chance. What was changed there cannot be told: JPEG has no
    checksums.

    Raises
    ------
    NotJpeg
        If it does.
    """
    _, at = _frame(data)
    scan = data.find(bytes((0xFF, _SCAN)), at)
    if scan < 0 or data.find(_END, scan) < 0:
        raise NotJpeg(f"is truncated: its {len(data)} bytes end before the JPEG does")


def _frame(data: bytes) -> tuple[int, int]:
    """Where the content of the segment with the size begins, and where it ends."""
    at = len(_START)
    for _ in range(_MOST_SEGMENTS):
        if len(data) < at + 4 or data[at] != 0xFF or data[at + 1] == _SCAN:
            break
        marker = data[at + 1]
        if marker == 0xFF or marker in _ALONE:
            at += 1 if marker == 0xFF else 2
            continue
        length = int.from_bytes(data[at + 2 : at + 4], "big")
        if marker in _FRAMES and length >= 8 and len(data) >= at + 4 + 5:
            return at + 4, at + 2 + length
        at += 2 + length
    raise NotJpeg(f"is truncated or damaged: no JPEG header in its {len(data)} bytes")
