"""Reading image files that are not trusted: a file is read whole, or refused in one line.

Decoders fill missing rows with grey and report nothing, so each file is checked for completeness first.
"""

import re
import zlib
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from matbench.errors import UserError, cause
from matbench.files import jpeg, tiff
from matbench.files.jpeg import is_jpeg
from matbench.files.plain import NotPlain, open_plain, read_plain
from matbench.files.tiff import is_tiff

LARGEST = 64_000_000
"""Most pixels of an image. What claims more is damaged, or meant to exhaust memory."""

LARGEST_FILE = 1 << 30
"""Most bytes of a file that is read into memory."""

ENDINGS = (".png", ".ppm", ".pgm", ".jpg", ".jpeg", ".tif", ".tiff")
"""What files of views are called, in the order in which they are looked for."""

_PNG = b"\x89PNG\r\n\x1a\n"
_PNG_GREY = 0
_PNG_CHANNELS = {_PNG_GREY: 1, 2: 3, 3: 1, 4: 2, 6: 4}  # colour type -> samples of a pixel
_NUMBERS = {b"\x93NUMPY": "npy", b"PK\x03\x04": "npz"}
_MOST_HEADER = 1 << 12  # bytes: a pattern that repeats keeps hundreds of bytes for each blank that it has passed
_PNM = re.compile(rb"P([56])(?:\s|#[^\n]*\n)+(\d{1,9})(?:\s|#[^\n]*\n)+(\d{1,9})(?:\s|#[^\n]*\n)+(\d{1,9})\s")


def read_rgb(path: Path, size: tuple[int, int] | None = None) -> NDArray[np.uint8]:
    """Read a PNG, PPM, PGM, JPEG or TIFF file. Of 16 bits a channel, the upper 8 are taken, rounded.

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
    image = _read_image(path, size)
    if image.dtype == np.uint8:
        return image
    return ((image.astype(np.uint32) * 255 + 32767) // 65535).astype(np.uint8)


def read_levels(path: Path, size: tuple[int, int] | None = None) -> NDArray[np.uint16]:
    """Read the levels of a grey image of 8 or 16 bits, as they are stored.

    Returns
    -------
    (H, W) uint16.

    Raises
    ------
    UserError
        As `read_rgb`, if the image is coloured, and if there are fewer than 8 bits a pixel: the decoder would
        stretch them to 256 levels, so that the stored levels are lost.
    """
    image = _read_image(path, size, levels=True)
    if (image != image[..., :1]).any():
        raise UserError(f"image {path} is coloured: ground truth is one grey level a pixel")
    return image[..., 0].astype(np.uint16)


def encoding(path: Path) -> str:
    """How a file of ground truth stores its numbers, by its header.

    It is ``grey8``, ``grey16``, ``pfm``, ``npy``, ``npz`` or ``tiff``.

    Raises
    ------
    UserError
        If it is missing, or of no such kind.
    """
    data = read_bytes(path, "ground truth", first=_MOST_HEADER)
    if data[:2] in (b"Pf", b"PF"):
        return "pfm"
    if known := next((kind for head, kind in _NUMBERS.items() if data.startswith(head)), None):
        return known
    if is_jpeg(data):
        raise UserError(f"{path} is a JPEG, which keeps no exact numbers: ground truth is PFM, PNG, PGM, TIFF or NPY")
    if is_tiff(data):
        return "tiff"
    _size(path, data)
    found = _PNM.match(data)
    is_deep = int(found[4]) > 255 if found else data[24] > 8
    return "grey16" if is_deep else "grey8"


def _read_image(path: Path, size: tuple[int, int] | None, levels: bool = False) -> NDArray[Any]:
    """(H, W, 3) uint8 or uint16, RGB; `levels` are wanted exactly as they are stored."""
    data = read_bytes(path)
    width, height = _size(path, data)
    if size is not None and (width, height) != size:
        raise UserError(f"image {path} is {width}x{height} px, not {size[0]}x{size[1]} as the others of its scene")
    if is_jpeg(data):
        return _decode_jpeg(path, data)
    if is_tiff(data):
        return _decode_tiff(path, data)
    return _decode_png(path, data, levels) if data.startswith(_PNG) else _decode_pnm(path, data)


def read_size(path: Path) -> tuple[int, int]:
    """(width, height) that the file's header states.

    Raises
    ------
    UserError
        If the file is missing or has no such header.
    """
    data = read_bytes(path, first=_MOST_HEADER)
    # in a TIFF the size may stand anywhere, and in a JPEG behind a preview
    return _size(path, read_bytes(path) if is_tiff(data) or is_jpeg(data) else data)


def pixel_digests(path: Path) -> set[str]:
    """SHA-256 of the decoded picture: the same for a PPM and a PNG of the same pixels.

    What is hashed is the ASCII text ``HxWx3:uint8:`` followed by the bytes of the (H, W, 3) RGB array. If all
    pixels are grey, there is a second digest, of ``HxW:uint8:`` and the bytes of the (H, W) array.

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


def read_bytes(path: Path, what: str = "image", limit: int = LARGEST_FILE, first: int = -1) -> bytes:
    """The bytes of a regular file, or the `first` of them.

    Raises
    ------
    UserError
        If it is missing, larger than `limit`, or no file: a pipe would never end.
    """
    try:
        if first < 0:
            return read_plain(path, most=limit)
        with open_plain(path, most=limit) as file:
            return file.read(first)
    except FileNotFoundError:
        raise UserError(f"{what} {path} is missing") from None
    except NotPlain as error:
        raise UserError(f"{what} {path} cannot be read: {error}") from None
    except ValueError:  # a null character
        raise UserError(f"{what} {str(path)!r} is missing: no file can have that name") from None
    except OSError as error:
        raise UserError(f"{what} {path} cannot be read: {cause(error)}") from None


def _size(path: Path, data: bytes) -> tuple[int, int]:
    if data.startswith(_PNG):
        if data[12:16] != b"IHDR" or len(data) < 33:
            raise UserError(f"image {path} is truncated or damaged: no PNG header in its {len(data)} bytes")
        width, height = (int.from_bytes(data[at : at + 4], "big") for at in (16, 20))
    elif is_jpeg(data):
        try:
            width, height = jpeg.size(data)
        except jpeg.NotJpeg as error:
            raise UserError(f"image {path} {error}") from None
    elif is_tiff(data):
        height, width = tiff.size(data) or (0, 0)
    else:
        found = _PNM.match(data[:_MOST_HEADER])
        if not found:
            what = f"starts with {data[:8]!r}" if data else "is empty"
            raise UserError(f"image {path} {what}: PNG, JPEG, TIFF and binary PPM or PGM (P6, P5) can be read")
        width, height = int(found[2]), int(found[3])
    if not (width > 0 and height > 0 and width * height <= LARGEST):
        raise UserError(f"image {path} claims {width}x{height} px: 1 to {LARGEST} px in all are possible")
    return width, height


def _decode_pnm(path: Path, data: bytes) -> NDArray[Any]:
    found = _PNM.match(data[:_MOST_HEADER])
    assert found is not None, "`_size` has matched it"  # noqa: S101
    width, height, channels = int(found[2]), int(found[3]), 3 if found[1] == b"6" else 1
    levels = int(found[4])
    if levels not in (255, 65535):
        raise UserError(f"image {path} has grey levels up to {levels}: 255 (8 bits) or 65535 (16 bits) is possible")
    kind = np.dtype(">u2" if levels > 255 else "u1")
    wanted, present = width * height * channels * kind.itemsize, len(data) - found.end()
    if present != wanted:
        what = "truncated" if present < wanted else "damaged"
        raise UserError(f"image {path} is {what}: {present} bytes of pixels, not {wanted} ({width}x{height})")
    pixels = np.frombuffer(data, kind, wanted // kind.itemsize, found.end()).reshape(height, width, channels)
    return np.ascontiguousarray(np.broadcast_to(pixels, (height, width, 3)), kind.newbyteorder("="))


def _decode_png(path: Path, data: bytes, levels: bool) -> NDArray[Any]:
    _check_png(path, data, levels)
    if (image := _decoded(data, deep=data[24] > 8)) is None:
        raise UserError(f"image {path} is damaged: its PNG data cannot be decoded")
    return image


def _decode_jpeg(path: Path, data: bytes) -> NDArray[Any]:
    try:
        jpeg.check_whole(data)
    except jpeg.NotJpeg as error:
        raise UserError(f"image {path} {error}") from None
    if (image := _decoded(data)) is None or image.shape[1::-1] != jpeg.size(data):
        raise UserError(f"image {path} is damaged: its JPEG data cannot be decoded")
    return image


def _decode_tiff(path: Path, data: bytes) -> NDArray[Any]:
    found = tiff.decode(data)
    if found is None or found.shape[:2] != tiff.size(data):
        raise UserError(f"image {path} is a damaged TIFF, or one of a kind that cannot be read")
    if found.dtype not in (np.uint8, np.uint16) or (found.ndim == 3 and found.shape[2] not in (1, 3, 4)):
        raise UserError(f"image {path} holds {found.shape} {found.dtype}: 8 or 16 bits of grey or colour are needed")
    colours = found[..., None] if found.ndim == 2 else found[..., :3]
    return np.ascontiguousarray(np.broadcast_to(colours[..., ::-1], (*found.shape[:2], 3)))


def _decoded(data: bytes, deep: bool = False) -> NDArray[Any] | None:
    """(H, W, 3) RGB as OpenCV decodes it; None if it cannot."""
    import cv2

    level = cv2.utils.logging.getLogLevel()
    cv2.utils.logging.setLogLevel(0)  # what is wrong is told by our own error
    depth = cv2.IMREAD_ANYDEPTH if deep else 0
    try:
        image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION | depth)
    except cv2.error:
        image = None
    finally:
        cv2.utils.logging.setLogLevel(level)
    return None if image is None else np.ascontiguousarray(image[..., ::-1])


def _check_png(path: Path, data: bytes, levels: bool) -> None:
    """Walk the chunks to the end, with their checksums, and unpack the pixels.

    Raises
    ------
    UserError
        If anything is missing or wrong.
    """
    width, height = _size(path, data)
    bits, colour, interlaced = data[24], data[25], data[28]
    if bits > 16 or colour not in _PNG_CHANNELS:
        raise UserError(f"image {path} has {bits} bits a channel (PNG colour type {colour}): up to 16 are possible")
    if levels and bits < 8 and colour == _PNG_GREY:
        raise UserError(f"image {path} has {bits} bits a channel: ground truth has 8 or 16")
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
