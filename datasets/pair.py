"""A pair of views as Middlebury lays it out since 2014: ``im0.png im1.png calib.txt disp0.pfm``.

``calib.txt`` has lines such as ``ndisp=280``. That number bounds the disparities loosely, without giving the
truth away, so 0 .. ndisp - 1 is searched. `vmin` and `vmax` are the ends of the truth itself, meant for
choosing colours, and are not used. Truth is infinite where it is unknown.

Reference: Scharstein et al., GCPR 2014; https://vision.middlebury.edu/stereo/data/scenes2014/
"""

import re
from pathlib import Path

from matbench.datasets.stored import StoredScene, TruthFile, image_file, inside
from matbench.errors import UserError
from matbench.files.images import read_bytes
from matbench.scene import Range

CALIBRATION = "calib.txt"

_LARGEST_FILE = 1 << 16


def pair(called: str, folder: Path) -> StoredScene:
    """The pair in a folder; truth of the right view is ``disp1.pfm``, if there.

    Raises
    ------
    UserError
        If its ``calib.txt`` or an image is missing or cannot be read.
    """
    path = folder / CALIBRATION
    facts = _facts(path)
    count = _whole(path, facts, "ndisp")
    size = (_whole(path, facts, "width"), _whole(path, facts, "height")) if "width" in facts else None
    maps = {view: f"disp{view}.pfm" for view in (0, 1)}
    truth = {view: TruthFile(inside(folder, name)) for view, name in maps.items() if (folder / name).is_file()}
    views = tuple(inside(folder, image_file(folder, f"im{view}").name) for view in (0, 1))
    return StoredScene(called, views, ("0", "1"), Range(0, count - 1), truth, size=size)


def _facts(path: Path) -> dict[str, str]:
    text = read_bytes(path, "calibration", _LARGEST_FILE).decode("utf-8", "replace")
    lines = (line.partition("=") for line in text.splitlines())
    return {key.strip(): value.strip() for key, equals, value in lines if equals}


def _whole(path: Path, facts: dict[str, str], key: str) -> int:
    value = facts.get(key, "")
    if not re.fullmatch(r"0*[1-9][0-9]{0,5}", value, re.ASCII):
        said = f"has {key}={value[:40]!r}" if key in facts else f"lacks {key}"
        raise UserError(f"calibration {path} {said}: a whole number from 1 such as {key}=280 is needed")
    return int(value)
