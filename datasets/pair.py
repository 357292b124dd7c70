"""A pair of views as Middlebury lays it out since 2014: ``im0.png im1.png calib.txt disp0.pfm``.

So do its evaluation since 2014 and ETH3D's two-view benchmark, where truth is called ``disp0GT.pfm`` and a mask,
``mask0nocc.png``, says what both views see: 255, against 128 for what is hidden and 0 for what is unknown.

``calib.txt`` has lines such as ``ndisp=280``. That number bounds the disparities loosely, without giving the
truth away, so 0 .. ndisp - 1 is searched. `vmin` and `vmax` are the ends of the truth itself, meant for
choosing colours, and are not used. Truth is infinite where it is unknown.

Reference: Scharstein et al., GCPR 2014; https://vision.middlebury.edu/stereo/data/scenes2014/;
https://www.eth3d.net/documentation.
"""

import re
from pathlib import Path

from matbench.datasets.stored import SeenFile, StoredScene, TruthFile, image_file, inside
from matbench.errors import UserError
from matbench.files.images import read_bytes
from matbench.scene import Range

CALIBRATION = "calib.txt"

_LARGEST_FILE = 1 << 16


def pair(called: str, folder: Path) -> StoredScene:
    """The pair in a folder; truth and mask of the right view have a 1 in their names, if there.

    Middlebury's metrics are suggested: ETH3D, whose folders look the same, reports the same ones.

    Raises
    ------
    UserError
        If its ``calib.txt`` or an image is missing or cannot be read.
    """
    path = folder / CALIBRATION
    facts = _facts(path)
    count = _whole(path, facts, "ndisp")
    size = (_whole(path, facts, "width"), _whole(path, facts, "height")) if "width" in facts else None
    truth = {
        view: TruthFile(inside(folder, name))
        for view in (1, 0)
        for name in (f"disp{view}GT.pfm", f"disp{view}.pfm")
        if (folder / name).is_file()
    }
    masks = {view: name for view in truth if (folder / (name := f"mask{view}nocc.png")).is_file()}
    seen = {view: SeenFile((inside(folder, name),), "mask") for view, name in masks.items()}
    views = tuple(inside(folder, image_file(folder, f"im{view}").name) for view in (0, 1))
    return StoredScene(
        called, views, ("0", "1"), Range(0, count - 1), truth, size=size, seen=seen, metrics="middlebury"
    )


def _facts(path: Path) -> dict[str, str]:
    text = read_bytes(path, "calibration", _LARGEST_FILE).decode("utf-8", "replace")
    lines = (line.partition("=") for line in text.splitlines())
    return {key.strip(): value.strip() for key, equals, value in lines if equals}


def _whole(path: Path, facts: dict[str, str], key: str) -> int:
    value = facts.get(key, "")
    if not re.fullmatch(r"0*[1-9][0-9]{0,5}(\.0{0,9})?", value, re.ASCII):
        said = f"has {key}={value[:40]!r}" if key in facts else f"lacks {key}"
        raise UserError(f"calibration {path} {said}: a whole number from 1 such as {key}=280 is needed")
    return int(value.partition(".")[0])
