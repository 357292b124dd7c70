"""Folders of KITTI, MPI Sintel and SceneFlow; the files are made up, in exactly their layouts."""

from collections.abc import Callable
from pathlib import Path

import dataset_layouts
import numpy as np
import pytest
from scene_files import check_one_line, write_png

from matbench import load_scene
from matbench.datasets.sequences import LAYOUTS, sequences_in
from matbench.errors import UserError
from matbench.scene import Range
from matbench.scenes.catalogue import select
from matbench.scenes.scene_check import check

TRUTH, SEEN = dataset_layouts.truth(), dataset_layouts.seen()
DENSE = {
    "sintel[frame=alley_1/frame_0001]": dataset_layouts.sintel,
    "sceneflow[frame=TRAIN/A/0000/0006]": dataset_layouts.sceneflow,
}


@pytest.mark.parametrize("name", DENSE)
def test_dense_truth_comes_back_to_the_last_bit(name: str, tmp_path: Path) -> None:
    make: Callable[[Path], Path] = DENSE[name]
    folder = make(tmp_path / make.__name__)
    scene = load_scene(str(tmp_path / name))
    assert (scene.n, scene.ref, scene.pair_steps, scene.disparities) == (2, 0, 1, Range(0, 16))
    np.testing.assert_array_equal(scene.truth[0], TRUTH)
    np.testing.assert_array_equal(scene.views[1], dataset_layouts.WORLD.view(1))
    np.testing.assert_array_equal(scene.regions["nonocc"], SEEN)
    assert not scene.sparse
    assert {"occ", "disc", "seen_once"} <= set(scene.scored_regions)
    assert {finding.verdict for finding in check(scene)} <= {"good", "unknown"}
    assert load_scene(str(folder)).digest == scene.digest, "its only frame"


@pytest.mark.parametrize("year", [2012, 2015])
def test_from_scattered_truth_nothing_is_derived(year: int, tmp_path: Path) -> None:
    folder, known = dataset_layouts.kitti(tmp_path, year), dataset_layouts.scattered()
    scene = load_scene(f"{folder}[frame=000000_10 disparities=0:64]")
    np.testing.assert_array_equal(scene.truth[0], np.where(known, TRUTH, np.nan))
    assert scene.disparities == Range(0, 64)
    assert scene.metrics == "kitti"
    assert list(scene.scored_regions) == ["all", "nonocc", "occ", "textureless"]
    np.testing.assert_array_equal(scene.regions["nonocc"], known & SEEN)
    np.testing.assert_array_equal(scene.regions["occ"], known & ~SEEN)
    (said,) = [finding.text for finding in check(scene) if finding.topic == "regions"]
    assert said == "truth is known at scattered pixels, 21 %, so disc are unknown"

    next((folder / ("disp_noc_0" if year == 2015 else "disp_noc")).iterdir()).unlink()
    scene = load_scene(str(folder))
    assert list(scene.scored_regions) == ["all"]
    (said,) = [finding.text for finding in check(scene) if finding.topic == "regions"]
    assert said.endswith("so nonocc, occ, disc, textureless are unknown")


def test_the_other_rendering_is_chosen_by_name(tmp_path: Path) -> None:
    folder = dataset_layouts.sintel(tmp_path / "training")
    clean, final = load_scene(str(folder)), load_scene(f"{folder}[pass=final]")
    np.testing.assert_array_equal(final.views, clean.views // 2)


def test_without_truth_a_range_must_be_given(tmp_path: Path) -> None:
    folder = dataset_layouts.kitti(tmp_path)
    for truth in (folder / "disp_occ_0").iterdir():
        truth.unlink()
    (folder / "disp_occ_0").rmdir()
    with pytest.raises(UserError, match="write disparities=0:192 after its name"):
        load_scene(str(folder))
    assert not load_scene(f"{folder}[disparities=0:192]").truth


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("kitti", ["holds many pairs of KITTI 2015", "[frame=000000_10]", "frames: 000000_10, 000001_10"]),
        ("kitti[frame=7]", ["has no frame '7'", "[frame=000000_10]"]),
        ("kitti[frame=../image_2/000000_10]", ["has no frame"]),
        ("kitti[frame=../../other/image_2/000000_10]", ["leads out of the folder"]),
        ("kitti[frame=000000_10 pass=final]", ["one rendering only"]),
        ("kitti[fram=000000_10]", ["did you mean 'frame'"]),
        ("sintel[pass=albedo]", ["clean, final is possible"]),
        ("empty", ["is laid out as SceneFlow, but has no frames in frames_cleanpass"]),
    ],
)
def test_wrong_names_are_one_line(name: str, words: list[str], tmp_path: Path) -> None:
    for frame in ("000000_10", "000001_10"):
        dataset_layouts.kitti(tmp_path / "kitti", frame=frame)
    dataset_layouts.sintel(tmp_path / "sintel")
    (tmp_path / "other" / "image_2").mkdir(parents=True)
    (tmp_path / "empty" / "frames_cleanpass").mkdir(parents=True)
    assert sequences_in(str(tmp_path / "kitti"))
    with pytest.raises(UserError) as error:
        load_scene(str(tmp_path / name))
    check_one_line(error.value)
    assert all(word in str(error.value) for word in words), error.value


def test_a_frame_without_truth_is_not_named_where_others_have_some(tmp_path: Path) -> None:
    folder = dataset_layouts.kitti(tmp_path)
    for side in ("image_2", "image_3"):  # the next frame of the video, as in KITTI
        write_png(folder / side / "000000_11.png", dataset_layouts.WORLD.view(0))
    assert load_scene(str(folder)).name == str(folder)
    assert not load_scene(f"{folder}[frame=000000_11 disparities=0:64]").truth


def test_frames_are_named_alike_in_all_layouts() -> None:
    for layout in LAYOUTS:
        assert layout.named(layout.left, "a/b/7", "clean").count("7") == 1
        assert "{" not in layout.named(layout.truth, "7", "clean")


def test_a_pattern_means_every_frame_with_truth(tmp_path: Path) -> None:
    for frame in ("000000_10", "000001_10", "000010_10"):
        folder = dataset_layouts.kitti(tmp_path / "kitti", frame=frame)
    write_png(folder / "image_2" / "000000_11.png", dataset_layouts.WORLD.view(0))
    found = select(f"{folder}[frame=* disparities=0:64]").names
    assert found == tuple(f"{folder}[frame=0000{n}_10 disparities=0:64]" for n in ("00", "01", "10"))
    assert len(select(f"{folder}[frame=00000*]").names) == 2
    with pytest.raises(UserError, match=r"has no frame 'x\*'"):
        select(f"{folder}[frame=x*]")
