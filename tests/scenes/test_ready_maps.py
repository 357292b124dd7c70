"""Which file is the map of which view."""

from pathlib import Path

import pytest
from attrs import evolve

from matbench import load_scene
from matbench.errors import UserError
from matbench.scene import Scene
from matbench.scenes.ready_maps import find


@pytest.fixture(scope="module")
def teddy() -> Scene:
    """Named and labelled as the real scene is."""
    scene = load_scene("synthetic/box[size=48x36 n=3]")
    return evolve(scene, name="middlebury2003/teddy[size=quarter]", labels=("im1", "im2", "im3"), ref=1)


def placed(folder: Path, *names: str) -> Path:
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).touch()
    return folder


@pytest.mark.parametrize(
    "name",
    [
        "teddy.pfm",
        "teddy.png",
        "teddy.npz",
        "middlebury2003/teddy.tiff",
        "middlebury2003/teddy[size=quarter].npy",
        "teddy[size=quarter].pfm",
        "teddy_2.pfm",
        "teddy_im2.pfm",
        "teddy-2.npy",
        "teddy/2.pfm",
        "teddy/im2.pfm",
        "teddy/disp2.pfm",
        "teddy/disp.pfm",
        "middlebury2003/teddy/disp0.pfm",
    ],
)
def test_names_that_people_give(name: str, teddy: Scene, tmp_path: Path) -> None:
    assert find(placed(tmp_path, name, "cones.pfm"), teddy) == {1: tmp_path / name}


def test_maps_of_further_views_come_along(teddy: Scene, tmp_path: Path) -> None:
    found = find(placed(tmp_path, "teddy_1.pfm", "teddy_2.pfm", "teddy_3.pfm"), teddy)
    assert found == {view: tmp_path / f"teddy_{view + 1}.pfm" for view in range(3)}


@pytest.mark.parametrize("pattern", ["run7/{scene}/final_{view}", "run7/{scene}/final_{view}.pfm"])
def test_a_pattern_of_ones_own(pattern: str, teddy: Scene, tmp_path: Path) -> None:
    placed(tmp_path, "run7/teddy/final_2.pfm", "teddy.pfm")
    assert find(tmp_path, teddy, pattern) == {1: tmp_path / "run7/teddy/final_2.pfm"}


def test_none_and_two_are_told(teddy: Scene, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"no map of middlebury2003/teddy.*view im2: looked for teddy, teddy_im2"):
        find(placed(tmp_path, "cones.pfm", "teddy_3.pfm"), teddy)
    with pytest.raises(UserError, match=r"two maps of .*teddy\.png"):
        find(placed(tmp_path, "teddy.pfm", "teddy.png"), teddy)


def test_the_left_map_of_two_is_not_guessed(teddy: Scene, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no map"):
        find(placed(tmp_path, "teddy/disp0.pfm", "teddy/disp1.pfm"), teddy)


@pytest.mark.parametrize("pattern", ["../{scene}", "/etc/{scene}", "{scene}/../../x", "a\0b"])
def test_patterns_stay_in_the_folder(pattern: str, teddy: Scene, tmp_path: Path) -> None:
    placed(tmp_path, "teddy.pfm", "in/x.pfm")
    with pytest.raises(UserError, match="has no map"):
        find(tmp_path / "in", teddy, pattern)


@pytest.mark.parametrize("pattern", ["{scene}_{frame}", "{scene", "{scene.name}", "{0}"])
def test_other_brackets_in_a_pattern_are_a_files_name(pattern: str, teddy: Scene, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="looked for"):
        find(tmp_path, teddy, pattern)
    name = pattern.replace("{scene}", "teddy")
    placed(tmp_path, f"{name}.pfm")
    assert find(tmp_path, teddy, pattern) == {1: tmp_path / f"{name}.pfm"}
