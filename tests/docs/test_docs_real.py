"""The commands that the documentation shows for real scenes are run, on the middle of their pictures."""

import re
import tomllib
from pathlib import Path

import cv2
import pytest
from following import HEIGHT, WIDTH, Desk, lines, shortened, table, words
from places import ROOT
from real import Real

from matbench.scenes.catalogue import group

SCENES = {
    "middlebury2001/tsukuba": ["middlebury/scenes2001/data/tsukuba"],
    "middlebury2003/teddy": ["middlebury/scenes2003/newdata/teddy", "middlebury/scenes2003/newdata/half/teddy"],
    "middlebury2006/Rocks1": ["middlebury/scenes2006/ThirdSize/Rocks1"],
    "hci/antinous": ["hci/additional/antinous"],
}
PICTURES = (".png", ".ppm", ".pgm", ".pfm")


@pytest.fixture(scope="module")
def middles(real: Real, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of real scenes as the data root, with the middle of each picture; those that are there."""
    root = tmp_path_factory.mktemp("data")
    for scene in (scene for folders in SCENES.values() for scene in folders if real.has(scene)):
        (root / scene).mkdir(parents=True)
        for path in (path for path in (real.root / scene).iterdir() if path.suffix in PICTURES):
            picture = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
            assert picture is not None
            top, left = (picture.shape[0] - HEIGHT) // 2, (picture.shape[1] - WIDTH) // 2
            middle = picture[top : top + HEIGHT, left : left + WIDTH]
            assert cv2.imwrite(str(root / scene / path.name), middle)
    return root


def asked(line: str) -> list[str]:
    """The folders of the scenes that a line names, also by a pattern or a word."""
    told = words(line)
    for file in (ROOT / word for word in told if word.endswith(".toml")):
        scenes = tomllib.loads(file.read_text())["scenes"]
        told = [*told, *([scenes] if isinstance(scenes, str) else scenes)]
    told = [re.sub(r"\[.*", "", word) for word in told]
    return [folder for name, folders in SCENES.items() for folder in folders if any(group(one, [name]) for one in told)]


@pytest.mark.parametrize("line", lines("real"), ids=str)
def test_commands_on_real_scenes_run(line: str, desk: Desk, middles: Path, real: Real) -> None:
    real(*asked(line))
    said = desk.follow(shortened(line, DIR=str(middles)))
    if "ablate" in line:
        scenes = {row["scene"].partition("[")[0] for row in table(desk.runs[-1] / "results.csv")}
        assert len(scenes) > 1
        assert "curves: " in said or "ablation: " in said
