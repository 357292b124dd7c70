"""A published scene of four small pictures, its archive, and what fetching it leaves."""

import io
import zipfile
from pathlib import Path, PurePosixPath

import cv2
import numpy as np

from matbench.files.transfer import Patience
from matbench.scenes.dataset import Download
from matbench.scenes.fetching import Result, fetch

QUICK = Patience(timeout=20, retries=1, pause=0.01)
SHORT = Patience(timeout=0.5, retries=1, pause=0.01)
FOLDER = PurePosixPath("toys/small/box")
NAMES = ("im0.ppm", "im1.ppm", "im2.ppm", "disp1.pgm")
rng = np.random.default_rng(3)
PIXELS = {name: rng.integers(0, 256, (30, 40, 3) if name.endswith("ppm") else (30, 40), np.uint8) for name in NAMES}


def encoded(name: str, pixels: np.ndarray) -> bytes:
    done, raw = cv2.imencode(Path(name).suffix, pixels)
    assert done
    return raw.tobytes()


PICTURES = {name: encoded(name, pixels) for name, pixels in PIXELS.items()}
OTHER = encoded("im0.ppm", np.zeros((30, 40, 3), np.uint8))


def zipped(*contents: tuple[str | zipfile.ZipInfo, bytes]) -> bytes:
    raw = io.BytesIO()
    with zipfile.ZipFile(raw, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in contents:
            archive.writestr(name, content)
    return raw.getvalue()


WHOLE = zipped(*((f"box/{name}", raw) for name, raw in PICTURES.items()), ("box/dmin.txt", b"1"))


def bring(toy: Download, root: Path, **options) -> Result:
    (result,) = fetch([toy], root, **{"patience": QUICK, **options})
    return result


def inside(root: Path) -> dict[str, bytes]:
    """Every file below the root but the locks, by its path."""
    return {
        str(path.relative_to(root)): path.read_bytes()
        for path in root.rglob("*")
        if path.is_file() and path.suffix != ".lock"
    }


PLACED = {str(FOLDER / name): raw for name, raw in PICTURES.items()}
