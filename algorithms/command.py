"""Other people's programs as methods: of two views as the Middlebury SDK calls them, or of all views with cameras."""

import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from math import ceil, floor
from pathlib import Path
from typing import Any, ClassVar

import cv2
import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray

from matbench.algorithm import Context, Estimate
from matbench.algorithms.cameras import LAYOUTS, Rig
from matbench.algorithms.sgbm import field_partner
from matbench.errors import UserError
from matbench.files.maps import read_map
from matbench.files.pfm import read_disparities
from matbench.files.temporary import temporary_folder
from matbench.scene import Scene

PLACES = ("{left}", "{right}", "{ndisp}", "{out}")
"""What stands for what the convention passes: two views."""
NUMBERS = ("{ref}", "{least}", "{largest}", "{near}", "{far}")
"""What stands for numbers that a program of many views may ask for."""
MAPS = ("disp0.pfm", "disp0_s.pfm")  # dense, sparse
ANSWERS = ("disp", "depth")  # of many views: disparities or depths of the reference view
_ANSWERS_IN = (".pfm", ".npy", ".npz", ".tif", ".tiff")
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
    """The file that a program's name or path means, if it may be run.

    A link stays one: the interpreter of a virtual environment finds its packages by the name it is called by.
    """
    found = shutil.which(os.path.expanduser(program))  # noqa: PTH111 (a bare name is looked for on PATH)
    return Path(os.path.abspath(found)) if found else None  # noqa: PTH100 (`resolve` follows links)


def _runs(_: object, __: Any, program: str) -> None:
    if _executable(program) is None:
        there = os.path.exists(os.path.expanduser(program))  # noqa: PTH110, PTH111
        what = "is no executable file: chmod +x it" if there else "does not exist: give the path of an executable"
        raise ValueError(f"program {program!r} {what}, as in command[program=./mine]")


def _has_places(_: object, __: Any, args: str) -> None:
    layouts = [place for place in LAYOUTS if place in args]
    wanted = ["{out}"] if layouts else ["{left}", "{right}", "{out}"]
    missing = [place for place in wanted if place not in args]
    if missing:
        raise ValueError(
            f"args {args!r} lack {', '.join(missing)}; possible places are {', '.join(PLACES)} for two views, "
            f"and {', '.join((*LAYOUTS, *NUMBERS))} for all of them"
        )
    if layouts and any(place in args for place in ("{left}", "{right}", "{ndisp}")):
        raise ValueError(f"args {args!r} mix two views with {layouts[0]}, which stands for all of them")
    _has_words(None, None, args)


def _has_words(_: object, __: Any, words: str) -> None:
    try:
        shlex.split(words)
    except ValueError as error:
        raise ValueError(f"{words!r} cannot be split into words: {error}") from error


@frozen
class Command:
    """Any executable that takes two images, or all with their cameras, and writes a map.

    Of two images, it is called as the ``run`` script of a method is in the Middlebury SDK (version 3),

        run LEFT.png RIGHT.png NDISP OUTDIR

    and writes ``OUTDIR/disp0.pfm``, or ``disp0_s.pfm`` if it has no dense map: one number a pixel
    of the left image, its disparity in pixels, infinite where it has no answer
    (https://vision.middlebury.edu/stereo/submit3/upload-format.html). Disparities 0 .. NDISP - 1 are
    to be searched. The ``time.txt`` that the SDK wants is not read: `seconds` is measured outside and
    includes writing the images and starting the program.

    The two images are those that `sgbm` matches, both mirrored if the other view is to the left. If the
    range does not begin at 0, it is shifted there: the two images are padded on opposite sides by the
    least disparity, with repeated edge pixels.

    A program of many views has one of these in its `args`, which stands for what is written for it:
    ``{views}``, a folder of ``im0.png`` ... from left to right; ``{json}``, a document with views, cameras and range;
    ``{colmap}``, ``{pmvs}``, ``{mvsnet}``, folders laid out as these programs read them (`algorithms.cameras`).
    ``{ref}`` is the number of the reference view from 0, ``{least}`` and ``{largest}`` are the range in pixels per
    view step, ``{near}`` and ``{far}`` in depth. Into ``{out}`` it writes ``disp`` (pixels per view step) or ``depth``
    of the reference view, as PFM, NPY, NPZ or TIFF; what is not finite is no answer, and neither is a depth of 0.

    The program is called by the name that was typed, in an empty folder of its own. A relative file, as the
    program or in its arguments, is looked for where matbench was started. The number of threads stands in
    OMP_NUM_THREADS. Its output goes to the cell's log. On Linux it is ended when the process that waits for it
    ends, for whatever reason.

    Parameters
    ----------
    program
        Its path, or a name on PATH. Its content decides the answer: another content is another cell.
    args
        Its arguments; ``{left}``, ``{right}``, ``{ndisp}`` and ``{out}`` stand for what the convention
        passes. No shell reads them. The content of files that they name decides the answer, too.
    files
        Further files whose content decides the answer, separated by blanks: what a script calls.
    """

    uneven: ClassVar[bool] = True

    program: str = field(validator=_runs)
    args: str = field(default=" ".join(PLACES), validator=_has_places)
    files: str = field(default="", validator=_has_words)

    @property
    def reads(self) -> Sequence[Path]:
        """The program, the files among its arguments and the further files."""
        named = [Path(word) for word in shlex.split(self.args) if os.path.isfile(word)]  # noqa: PTH113 (any text)
        further = [Path(file) for file in shlex.split(self.files)]
        return [_executable(self.program) or Path(self.program), *named, *further]

    def solve(self, scene: Scene, context: Context) -> Estimate:
        """Disparities of the reference view.

        Raises
        ------
        RuntimeError
            If the program ends with another status than 0, or writes no map.
        UserError
            If what it writes is no map of the image's size, or holds no disparities.
        """
        if layouts := [place for place in LAYOUTS if place in self.args]:
            return Estimate({scene.ref: self._of_all(scene, layouts, context.threads)})
        partner = field_partner(scene)
        gap, flip = abs(scene.steps(partner)), -1 if partner < scene.ref else 1
        least, largest = floor(scene.disparities.least * gap), ceil(scene.disparities.largest * gap)
        before, after = max(0, -least), max(0, least)
        left, right = scene.views[scene.ref][:, ::flip], scene.views[partner][:, ::flip]
        with temporary_folder() as folder:
            _write(folder / "im0.png", left, before, after)
            _write(folder / "im1.png", right, after, before)
            (folder / "out").mkdir()
            values = str(folder / "im0.png"), str(folder / "im1.png"), str(largest - least + 1), str(folder / "out")
            self._call(folder, dict(zip(PLACES, values, strict=True)), context.threads)
            pair = self._read(folder / "out", (before + scene.width + after, scene.height))
        disparity = (pair[:, before : before + scene.width] + np.float32(least)) / np.float32(gap)
        return Estimate({scene.ref: np.ascontiguousarray(disparity[:, ::flip])})

    def _of_all(self, scene: Scene, layouts: Sequence[str], threads: int) -> NDArray[np.float32]:
        """The map of the reference view that a program of many views writes, px per view step."""
        rig = Rig.of(scene)
        near, far = rig.depths
        numbers = (scene.ref, scene.disparities.least, scene.disparities.largest, near, far)
        values = {name: f"{number:.12g}" for name, number in zip(NUMBERS, numbers, strict=True)}
        with temporary_folder() as folder:
            for place in layouts:
                name, write = LAYOUTS[place]
                target = folder / name
                (target.parent if target.suffix else target).mkdir(parents=True)
                write(rig, target)
                values[place] = str(target)
            (folder / "out").mkdir()
            self._call(folder, {**values, "{out}": str(folder / "out")}, threads)
            return self._read_one(folder / "out", rig)

    def _read_one(self, out: Path, rig: Rig) -> NDArray[np.float32]:
        """The disparities, or the depths as disparities."""
        possible = [(name, out / f"{name}{ending}") for name in ANSWERS for ending in _ANSWERS_IN]
        found = [(name, path) for name, path in possible if path.is_file()]
        if len(found) != 1:
            there = ", ".join(sorted(path.name for path in out.iterdir())[:5]) or "nothing"
            wanted = f"one of {', '.join(ANSWERS)}, as {', '.join(ending[1:] for ending in _ANSWERS_IN)}"
            raise RuntimeError(f"{self.program} ended well but its folder {{out}} has not {wanted}: {there}")
        ((name, path),) = found
        size = rig.scene.width, rig.scene.height
        if path.suffix == ".pfm" and name == "disp":
            return read_disparities(path, size, f"map of {self.program}")
        values = read_map(path)
        if values.shape[::-1] != size:
            shape = "{1}x{0}".format(*values.shape)
            raise UserError(f"map of {self.program} is {shape} px, not {size[0]}x{size[1]} as its view")
        return values if name == "disp" else rig.disparity(values)

    def _call(self, folder: Path, values: Mapping[str, str], threads: int) -> None:
        program = _executable(self.program)
        if program is None:
            raise RuntimeError(f"{self.program} is no executable file any more")
        words = [os.path.abspath(word) if os.path.isfile(word) else word for word in shlex.split(self.args)]  # noqa: PTH100, PTH113
        for name, value in values.items():
            words = [word.replace(name, value) for word in words]
        work = folder / "work"
        work.mkdir()
        line = [sys.executable, "-I", "-S", "-c", _BOUND, str(os.getpid()), str(program), *words]
        tail = b""
        with subprocess.Popen(  # noqa: S603 (a list of arguments, no shell)
            line,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            cwd=work,
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
