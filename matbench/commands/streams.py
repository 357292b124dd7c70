"""Standard output and errors that never end a command: what cannot be written is left out, and is remembered.

A reader may leave (``| head``), a disk may be full, a terminal may be closed, and none of that is a reason to lose
work. So the two streams of the process are replaced, once and at the start, by ones whose writing does not fail.
Characters that the encoding lacks are replaced, too.
"""

import io
import os
import select
import sys
from errno import EIO, EPIPE
from typing import Any, TextIO

_NOBODY = (EPIPE, EIO)  # whoever read has left, or the terminal is closed: nobody is there to be told
_WIDEST = 10_000


class LastingFile(io.RawIOBase):
    """An open file descriptor whose first failure ends the writing, silently.

    Parameters
    ----------
    number
        The file descriptor.
    """

    def __init__(self, number: int) -> None:
        self._number = number
        self.lost: OSError | None = None

    def fileno(self) -> int:
        return self._number

    def writable(self) -> bool:
        return True

    def isatty(self) -> bool:
        return self.lost is None and os.isatty(self._number)

    def write(self, data: Any, /) -> int:
        rest = memoryview(data).cast("B")
        size = len(rest)
        while rest and self.lost is None:
            try:
                rest = rest[os.write(self._number, rest) :]
            except BlockingIOError:  # the other end has set the pipe so
                select.select([], [self._number], [])
            except OSError as error:
                self.lost = error
        return size


_output: LastingFile | None = None
_is_spare = False


def open_lasting() -> None:
    """Replace the standard streams of this process; those that were closed lead nowhere."""
    global _output
    _fill_closed()
    _output = LastingFile(1)
    sys.stdout = _text(_output, sys.stdout)
    sys.stderr = _text(LastingFile(2), sys.stderr)


def _fill_closed() -> None:
    """Open descriptors 0 to 2 where they are closed: else a file of the run would get the number, and be printed to."""
    while (number := os.open(os.devnull, os.O_RDWR)) <= 2:
        os.set_inheritable(number, True)
    os.close(number)


def _text(file: LastingFile, before: TextIO | None) -> TextIO:
    encoding = getattr(before, "encoding", None) or "utf-8"
    buffered = io.BufferedWriter(file)
    return io.TextIOWrapper(buffered, encoding, errors="replace", line_buffering=file.isatty() or file.fileno() == 2)


def mend_width() -> None:
    """Forget a ``COLUMNS`` or ``LINES`` that is no size of a terminal: libraries fail on it, or fill the memory."""
    for name in ("COLUMNS", "LINES"):
        said = os.environ.get(name, "")
        if not (said.isascii() and said.isdecimal() and 0 < int(said[:9]) <= _WIDEST):
            os.environ.pop(name, None)


def spare_output() -> None:
    """Say that all that this command prints is in files, too: output that is lost does not change its exit status."""
    global _is_spare
    _is_spare = True


def fault() -> str:
    """Why standard output is not what it should be, in words; empty if it is, or if nobody reads it."""
    if _output is None:
        return ""
    sys.stdout.flush()
    lost = _output.lost
    return "" if lost is None or lost.errno in _NOBODY else lost.strerror or str(lost)


def is_spare() -> bool:
    """Was `spare_output` called?"""
    return _is_spare
