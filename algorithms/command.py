"""Other people's programs as methods, called as the Middlebury SDK calls them."""

import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from math import ceil, floor
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray

from matbench.algorithm import Context, Estimate
from matbench.algorithms.sgbm import field_partner
from matbench.files.pfm import read_disparities
from matbench.scene import Scene

PLACES = ("{left}", "{right}", "{ndisp}", "{out}")
MAPS = ("disp0.pfm", "disp0_s.pfm")  # dense, sparse
_TAIL = 2000  # bytes of output that an error is told from

# Becomes the program once the kernel has promised to end it with the process that waits for it (Linux);
# a function run between fork and exec would not be safe beside threads.
_BOUND = """
import ctypes, os, signal, sys
try:
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)
except (OSError, AttributeError):
    pass
if os.getppid() != int(sys.argv[1]):
    os._exit(1)
try:
    os.execv(sys.argv[2], sys.argv[2:])
except OSError as error:
    sys.exit(f"{sys.argv[2]} cannot be started: {error.strerror}")
"""


def _executable(program: str) -> Path | None:
    """The file that a program's name or path means, if it may be run."""
    found = shutil.which(os.path.expanduser(program))  # noqa: PTH111 (a bare name is looked for on PATH)
    return Path(found).resolve() if found else None


def _runs(_: object, __: Any, program: str) -> None:
    if _executable(program) is None:
        there = os.path.exists(os.path.expanduser(program))  # noqa: PTH110, PTH111
        what = "is no executable file: chmod +x it" if there else "does not exist: give the path of an executable"
        raise ValueError(f"program {program!r} {what}, as in command[program=./mine]")


def _has_places(_: object, __: Any, args: str) -> None:
    missing = [place for place in PLACES if place not in args and place != "{ndisp}"]
    if missing:
        raise ValueError(f"args {args!r} lack {', '.join(missing)}; possible places are {', '.join(PLACES)}")
    try:
        shlex.split(args)
    except ValueError as error:
        raise ValueError(f"args {args!r} cannot be split into words: {error}") from error


@frozen
class Command:
    """Any executable that takes two images and a number of disparities and writes a PFM file.

    It is called as the ``run`` script of a method is in the Middlebury SDK (version 3),

        run LEFT.png RIGHT.png NDISP OUTDIR

    and writes ``OUTDIR/disp0.pfm``, or ``disp0_s.pfm`` if it has no dense map: one number a pixel
    of the left image, its disparity in pixels, infinite where it has no answer
    (https://vision.middlebury.edu/stereo/submit3/upload-format.html). Disparities 0 .. NDISP - 1 are
    to be searched. The ``time.txt`` that the SDK wants is not read: `seconds` is measured outside and
    includes writing the images and starting the program.

    The two images are those that `sgbm` matches, both mirrored if the other view is to the left. If the
    range does not begin at 0, it is shifted there: the two images are padded on opposite sides by the
    least disparity, with repeated edge pixels. The program starts in its own folder; the number of
    threads stands in OMP_NUM_THREADS. Its output goes to the cell's log. On Linux it is ended when the
    process that waits for it ends, for whatever reason.

    Parameters
    ----------
    program
        Its path, or a name on PATH. Its content decides the answer: another content is another cell.
    args
        Its arguments; ``{left}``, ``{right}``, ``{ndisp}`` and ``{out}`` stand for what the convention
        passes. No shell reads them.
    files
        Further files whose content decides the answer, separated by blanks: what a script calls.
    """

    program: str = field(validator=_runs)
    args: str = field(default=" ".join(PLACES), validator=_has_places)
    files: str = ""

    @property
    def reads(self) -> Sequence[Path]:
        """The program and the further files."""
        return [_executable(self.program) or Path(self.program), *(Path(file) for file in shlex.split(self.files))]

    def solve(self, scene: Scene, context: Context) -> Estimate:
        """Disparities of the reference view.

        Raises
        ------
        RuntimeError
            If the program ends with another status than 0, or writes no map.
        UserError
            If what it writes is no PFM file of the image's size, or holds no disparities.
        """
        partner = field_partner(scene)
        gap, flip = abs(partner - scene.ref), -1 if partner < scene.ref else 1
        least, largest = floor(scene.disparities.least * gap), ceil(scene.disparities.largest * gap)
        before, after = max(0, -least), max(0, least)
        left, right = scene.views[scene.ref][:, ::flip], scene.views[partner][:, ::flip]
        with tempfile.TemporaryDirectory(prefix="matbench-") as place:
            folder = Path(place)
            _write(folder / "im0.png", left, before, after)
            _write(folder / "im1.png", right, after, before)
            (folder / "out").mkdir()
            self._call(folder, largest - least + 1, context.threads)
            pair = self._read(folder / "out", (before + scene.width + after, scene.height))
        disparity = (pair[:, before : before + scene.width] + np.float32(least)) / np.float32(gap)
        return Estimate({scene.ref: np.ascontiguousarray(disparity[:, ::flip])})

    def _call(self, folder: Path, ndisp: int, threads: int) -> None:
        program = _executable(self.program)
        if program is None:
            raise RuntimeError(f"{self.program} is no executable file any more")
        values = str(folder / "im0.png"), str(folder / "im1.png"), str(ndisp), str(folder / "out")
        words = shlex.split(self.args)
        for name, value in zip(PLACES, values, strict=True):
            words = [word.replace(name, value) for word in words]
        line = [sys.executable, "-I", "-S", "-c", _BOUND, str(os.getpid()), str(program), *words]
        tail = b""
        with subprocess.Popen(  # noqa: S603 (a list of arguments, no shell)
            line,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            cwd=program.parent,
            env={**os.environ, "OMP_NUM_THREADS": str(threads)},
        ) as process:
            try:
                assert process.stdout is not None  # noqa: S101 (a pipe was asked for)
                while chunk := os.read(process.stdout.fileno(), 1 << 16):
                    print(chunk.decode("utf-8", "replace"), end="", flush=True)
                    tail = (tail + chunk)[-_TAIL:]
            except BaseException:
                process.kill()
                raise
        if process.returncode:
            said = " | ".join(tail.decode("utf-8", "replace").split("\n")[-6:]).strip(" |")
            how = f"exit status {process.returncode}" if process.returncode > 0 else f"signal {-process.returncode}"
            raise RuntimeError(f"{self.program} ended with {how}{': ' + said if said else ', saying nothing'}")

    def _read(self, out: Path, size: tuple[int, int]) -> NDArray[np.float32]:
        found = next((out / name for name in MAPS if (out / name).is_file()), None)
        if found is None:
            others = ", ".join(sorted(path.name for path in out.iterdir())[:5]) or "nothing"
            raise RuntimeError(f"{self.program} ended well but wrote no {MAPS[0]} into its folder {{out}}: {others}")
        return read_disparities(found, size, f"map of {self.program}")


def _write(path: Path, image: NDArray[np.uint8], before: int, after: int) -> None:
    wide = np.pad(image, ((0, 0), (before, after), (0, 0)), mode="edge")
    if not cv2.imwrite(str(path), wide[..., ::-1]):
        raise OSError(f"{path} could not be written")
