"""The commands that the documentation shows for real scenes are run, on the middle of their pictures."""

from pathlib import Path

import cv2
import pytest
from following import HEIGHT, WIDTH, Desk, lines, shortened, table

SCENES = (
    "middlebury/scenes2001/data/tsukuba",
    "middlebury/scenes2003/newdata/teddy",
    "middlebury/scenes2003/newdata/half/teddy",
    "middlebury/scenes2006/ThirdSize/Rocks1",
    "hci/additional/antinous",
)
PICTURES = (".png", ".ppm", ".pgm", ".pfm")


@pytest.fixture(scope="module")
def middles(data_root: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of real scenes as the data root, with the middle of each picture."""
    root = tmp_path_factory.mktemp("data")
    for scene in SCENES:
        (root / scene).mkdir(parents=True)
        for path in (path for path in (data_root / scene).iterdir() if path.suffix in PICTURES):
            picture = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
            assert picture is not None
            top, left = (picture.shape[0] - HEIGHT) // 2, (picture.shape[1] - WIDTH) // 2
            middle = picture[top : top + HEIGHT, left : left + WIDTH]
            assert cv2.imwrite(str(root / scene / path.name), middle)
    return root


@pytest.mark.parametrize("line", lines("real"), ids=str)
def test_commands_on_real_scenes_run(line: str, desk: Desk, middles: Path) -> None:
    said = desk.follow(shortened(line, DIR=str(middles)))
    if "ablate" in line:
        scenes = {row["scene"].partition("[")[0] for row in table(desk.runs[-1] / "results.csv")}
        assert len(scenes) > 1
        assert "curves: " in said or "ablation: " in said
