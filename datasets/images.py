"""Image files that come from elsewhere: read whole, or refused in one line.

Decoders fill what is missing with grey and go on, so a file's completeness is checked first.
"""

import re
import zlib
from hashlib import sha256
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from matbench.errors import UserError

LARGEST = 64_000_000
"""Most pixels of an image. What claims more is damaged, or meant to exhaust memory."""

_PNG = b"\x89PNG\r\n\x1a\n"
_PNG_CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}  # colour type -> samples of a pixel
_PNM = re.compile(rb"P([56])(?:\s|#[^\n]*\n)+(\d{1,9})(?:\s|#[^\n]*\n)+(\d{1,9})(?:\s|#[^\n]*\n)+(\d{1,9})\s")


def read_rgb(path: Path, size: tuple[int, int] | None = None) -> NDArray[np.uint8]:
    """Read a PNG, PPM or PGM file of 8 bits a channel.

    Parameters
    ----------
    path
        The file.
    size
        (width, height) that it must have, if that is known.

    Returns
    -------
    (H, W, 3) uint8, RGB.

    Raises
    ------
    UserError
        If it is missing, of another kind, truncated, damaged or of another size.
    """
    data = _read(path)
    width, height = _size(path, data)
    if size is not None and (width, height) != size:
        raise UserError(f"image {path} is {width}x{height} px, not {size[0]}x{size[1]} as the others of its scene")
    return _decode_png(path, data) if data.startswith(_PNG) else _decode_pnm(path, data)


def read_grey(path: Path, size: tuple[int, int] | None = None) -> NDArray[np.uint8]:
    """Read a grey image, such as ground truth: as `read_rgb`, but (H, W) uint8.

    Raises
    ------
    UserError
        As `read_rgb`, and if the image is coloured.
    """
    image = read_rgb(path, size)
    if (image != image[..., :1]).any():
        raise UserError(f"image {path} is coloured: ground truth is one grey level a pixel")
    return np.ascontiguousarray(image[..., 0])


def read_size(path: Path) -> tuple[int, int]:
    """(width, height) that the file's header states.

    Raises
    ------
    UserError
        If the file is missing or has no such header.
    """
    return _size(path, _read(path, 4096))


def pixel_digests(path: Path) -> set[str]:
    """SHA-256 of the decoded picture: the same for a PPM and a PNG of the same pixels.

    Of the ASCII text ``HxWx3:uint8:`` and the bytes of the (H, W, 3) RGB array; where all pixels are
    grey, also of ``HxW:uint8:`` and those of the (H, W) array.

    Raises
    ------
    UserError
        As `read_rgb`.
    """
    image = read_rgb(path)
    height, width = image.shape[:2]
    found = {sha256(f"{height}x{width}x3:uint8:".encode() + image.tobytes()).hexdigest()}
    if (image == image[..., :1]).all():
        found.add(sha256(f"{height}x{width}:uint8:".encode() + image[..., 0].tobytes()).hexdigest())
    return found


def has_pixels(path: Path, digest: str) -> bool:
    """Does the file hold the picture of that digest, in whatever format?"""
    try:
        return digest in pixel_digests(path)
    except UserError:
        return False


def _read(path: Path, limit: int = -1) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(limit)
    except FileNotFoundError:
        raise UserError(f"image {path} is missing") from None
    except OSError as error:
        raise UserError(f"image {path} cannot be read: {error.strerror}") from None


def _size(path: Path, data: bytes) -> tuple[int, int]:
    if data.startswith(_PNG):
        if data[12:16] != b"IHDR" or len(data) < 33:
            raise UserError(f"image {path} is truncated or damaged: no PNG header in its {len(data)} bytes")
        width, height = (int.from_bytes(data[at : at + 4], "big") for at in (16, 20))
    else:
        found = _PNM.match(data)
        if not found:
            what = f"starts with {data[:8]!r}" if data else "is empty"
            raise UserError(f"image {path} {what}: PNG and binary PPM or PGM (P6, P5) can be read")
        width, height = int(found[2]), int(found[3])
    if not (width > 0 and height > 0 and width * height <= LARGEST):
        raise UserError(f"image {path} claims {width}x{height} px: 1 to {LARGEST} px in all are possible")
    return width, height


def _decode_pnm(path: Path, data: bytes) -> NDArray[np.uint8]:
    found = _PNM.match(data)
    assert found is not None, "`_size` has matched it"  # noqa: S101
    width, height, channels = int(found[2]), int(found[3]), 3 if found[1] == b"6" else 1
    if int(found[4]) != 255:
        raise UserError(f"image {path} has grey levels up to {int(found[4])}: 255 (8 bits) is possible")
    wanted, present = width * height * channels, len(data) - found.end()
    if present != wanted:
        what = "truncated" if present < wanted else "damaged"
        raise UserError(f"image {path} is {what}: {present} bytes of pixels, not {wanted} ({width}x{height})")
    pixels = np.frombuffer(data, np.uint8, wanted, found.end()).reshape(height, width, channels)
    return np.ascontiguousarray(np.broadcast_to(pixels, (height, width, 3)))


def _decode_png(path: Path, data: bytes) -> NDArray[np.uint8]:
    import cv2

    _check_png(path, data)
    level = cv2.utils.logging.getLogLevel()
    cv2.utils.logging.setLogLevel(0)  # what is wrong is told by our own error
    try:
        image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    except cv2.error:
        image = None
    finally:
        cv2.utils.logging.setLogLevel(level)
    if image is None:
        raise UserError(f"image {path} is damaged: its PNG data cannot be decoded")
    return np.ascontiguousarray(image[..., ::-1])


def _check_png(path: Path, data: bytes) -> None:
    """Walk the chunks to the end, with their checksums, and unpack the pixels.

    Raises
    ------
    UserError
        If anything is missing or wrong.
    """
    width, height = _size(path, data)
    bits, colour, interlaced = data[24], data[25], data[28]
    if bits > 8 or colour not in _PNG_CHANNELS:
        raise UserError(f"image {path} has {bits} bits a channel (PNG colour type {colour}): up to 8 are possible")
    at, packed = len(_PNG), []
    while True:
        length, kind = int.from_bytes(data[at : at + 4], "big"), data[at + 4 : at + 8]
        body, checksum = data[at + 8 : at + 8 + length], data[at + 8 + length : at + 12 + length]
        if len(checksum) < 4:
            raise UserError(f"image {path} is truncated: its {len(data)} bytes end before the PNG does")
        if zlib.crc32(kind + body) != int.from_bytes(checksum, "big"):
            raise UserError(f"image {path} is damaged: a PNG checksum is wrong at byte {at}")
        if kind == b"IDAT":
            packed.append(body)
        if kind == b"IEND":
            break
        at += 12 + length
    wanted = height * (1 + (width * bits * _PNG_CHANNELS[colour] + 7) // 8)
    unpacker = zlib.decompressobj()
    try:
        # an interlaced image has more, partly filled, rows
        found = len(unpacker.decompress(b"".join(packed), wanted + (wanted + 16 * height if interlaced else 1)))
    except zlib.error:
        found = -1
    if found < wanted or (found > wanted and not interlaced):
        raise UserError(f"image {path} is damaged: its PNG data do not hold {width}x{height} px")
