"""Scenes kept as files: which files, what the numbers in them mean, and what is wrong with them."""

from pathlib import Path

import numpy as np
import pytest
from attrs import evolve
from scene_files import Layers, pfm_bytes, write_png

from matbench.datasets.stored import (
    ROUND_UP,
    StoredScene,
    TruthFile,
    check_options,
    image_file,
    inside,
)
from matbench.errors import UserError
from matbench.scene import Range

WORLD = Layers(width=48, height=40)


@pytest.fixture
def stored(tmp_path: Path) -> StoredScene:
    """Three views from left to right; the middle one has truth, two pixels above the world's."""
    files = tuple(tmp_path / f"v{view}.png" for view in range(3))
    for view, file in enumerate(files):
        write_png(file, WORLD.view(view - 1))
    levels = np.round((WORLD.truth() + 2) * 16).astype(np.uint8)
    levels[:2] = 0
    write_png(tmp_path / "truth.png", levels)
    truth = {1: TruthFile(tmp_path / "truth.png", scale=16, unknown=0)}
    return StoredScene("toy", files, ("0", "1", "2"), Range(-2, 5), truth)


def test_options_are_those_of_all_scenes_and_of_the_dataset() -> None:
    check_options("toy", ["views", "ref", "size"], own=("size",))
    with pytest.raises(UserError, match=r"unknown option 'size' of toy: .*Possible: baseline, disparities, predict"):
        check_options("toy", ["size"])


def test_an_image_is_found_whatever_its_format(tmp_path: Path) -> None:
    assert image_file(tmp_path, "im0") == tmp_path / "im0.png", "where there is none"
    (tmp_path / "im0.pgm").touch()
    assert image_file(tmp_path, "im0") == tmp_path / "im0.pgm"
    (tmp_path / "im0.ppm").touch()
    assert image_file(tmp_path, "im0") == tmp_path / "im0.ppm"


@pytest.mark.parametrize("name", ["../secret", "/etc/passwd", "sub/../../secret", "out", "loop", "a\0b"])
def test_no_name_leads_out_of_the_folder(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "scene"
    folder.mkdir()
    (folder / "out").symlink_to(tmp_path / "secret")
    (folder / "loop").symlink_to(folder / "loop")
    with pytest.raises(UserError, match=r"leads out of the folder|is no file name") as error:
        inside(folder, name)
    assert "\n" not in str(error.value)
    assert inside(folder, "sub/../im0.png").name == "im0.png"


def test_numbers_of_a_truth_file_are_scaled_and_some_are_unknown(stored: StoredScene, tmp_path: Path) -> None:
    truth = stored.truth[1].read((48, 40))
    assert truth.dtype == np.float32
    assert np.isnan(truth[:2]).all()
    np.testing.assert_array_equal(truth[2:], WORLD.truth()[2:] + 2)
    (tmp_path / "truth.pfm").write_bytes(pfm_bytes(WORLD.truth()))
    np.testing.assert_array_equal(TruthFile(tmp_path / "truth.pfm").read((48, 40)), WORLD.truth())


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"scale": 0.1}, r"has 720 px per view step, more than the 48 px of a row: its scale, 0\.1, is not right"),
        ({"path": Path("/nowhere/truth.png")}, "/nowhere/truth.png"),
    ],
)
def test_a_truth_file_that_cannot_be_right_is_refused(stored: StoredScene, change: dict, said: str) -> None:
    with pytest.raises(UserError, match=said):
        evolve(stored.truth[1], **change).read((48, 40))


def test_truth_that_is_unknown_everywhere_is_refused(stored: StoredScene, tmp_path: Path) -> None:
    write_png(tmp_path / "truth.png", np.zeros((40, 48), np.uint8))
    with pytest.raises(UserError, match="is unknown everywhere"):
        stored.load({})


def test_the_scene_is_what_lies_in_the_files(stored: StoredScene) -> None:
    scene = stored.load({})
    assert (scene.name, scene.labels, scene.ref, scene.pair_steps) == ("toy", ("0", "1", "2"), 1, 1)
    assert (scene.disparities.least, scene.disparities.largest) == (-2, 5)
    for view in range(3):
        np.testing.assert_array_equal(scene.views[view], WORLD.view(view - 1))
    assert set(scene.truth) == {1}
    assert {"all", "nonocc", "occ"} <= set(scene.regions)
    assert stored.problems() == []


def test_a_range_that_nobody_gave_holds_the_nearest_truth(stored: StoredScene) -> None:
    for steps, largest in ((1, ROUND_UP), (2, ROUND_UP / 2)):
        files = (*stored.views, *stored.views[:2])
        wide = evolve(
            stored, views=files, labels=tuple("01234"), disparities=None, pair_steps=steps, truth={2: stored.truth[1]}
        )
        scene = wide.load({})
        assert (scene.disparities.least, scene.disparities.largest) == (0, largest)
    given = evolve(stored, disparities=None).load({"disparities": "-3:7"})
    assert (given.disparities.least, given.disparities.largest) == (-3, 7)


def test_views_of_a_column_are_turned_to_lie_in_a_row(stored: StoredScene) -> None:
    row, column = stored.load({}), evolve(stored, column=True).load({})
    np.testing.assert_array_equal(column.views, np.rot90(row.views, axes=(1, 2)))
    np.testing.assert_array_equal(column.truth[1], np.rot90(row.truth[1]))


def test_views_that_should_be_scored_first_are(stored: StoredScene) -> None:
    assert evolve(stored, truth={}).load({}).ref == 1, "the middle one"
    assert evolve(stored, truth={}, preferred=(2, 0)).load({}).ref == 2
    assert stored.load({"views": "0:2"}).ref == 1


def test_a_pair_that_lies_outside_is_refused(stored: StoredScene) -> None:
    with pytest.raises(UserError, match=r"toy: no view lies 5 steps \(pair_steps\) from its reference view 1"):
        evolve(stored, pair_steps=5).load({})


def test_every_file_that_is_wrong_is_told(stored: StoredScene, tmp_path: Path) -> None:
    write_png(tmp_path / "v2.png", np.zeros((40, 50, 3), np.uint8))
    write_png(tmp_path / "truth.png", np.ones((9, 9), np.uint8))
    stored.views[0].unlink()
    found = evolve(stored, size=(48, 40)).problems()
    assert len(found) == 3
    for line, name in zip(found, ("v0.png", "v2.png", "truth.png"), strict=True):
        assert name in line
        assert "\n" not in line
