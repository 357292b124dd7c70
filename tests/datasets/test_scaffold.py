"""Writing a scene.toml for a folder of images."""

import tomllib
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scene_files import pfm_bytes, write_png

from matbench import load_scene
from matbench.datasets.scaffold import natural, write_scene_toml
from matbench.errors import UserError
from matbench.scene import Range, Scene
from matbench.scenes.scene_check import check

NUMBERS = (8, 9, 10, 11, 12)


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene("synthetic/box[size=320x240]")


@pytest.fixture
def folder(tmp_path: Path, scene: Scene) -> Path:
    for number, view in zip(NUMBERS, scene.views, strict=True):
        write_png(tmp_path / f"im{number}.png", view)
    return tmp_path


def test_names_sort_as_people_do() -> None:
    assert sorted(["a10", "a9", "B1", "a", "9", "10"], key=natural) == ["9", "10", "a", "a9", "a10", "B1"]


@given(st.lists(st.text("ab01٣²", max_size=5)))
def test_any_names_can_be_sorted(names: list[str]) -> None:
    assert sorted(sorted(names, key=natural)) == sorted(names)


def test_the_scene_of_a_folder_of_images(folder: Path, scene: Scene) -> None:
    draft = write_scene_toml(folder)
    found = load_scene(str(folder))
    assert found.labels == ("8", "9", "10", "11", "12")
    np.testing.assert_array_equal(found.views, scene.views)
    truth = scene.truth[scene.ref]
    assert found.disparities.least <= truth.min() < truth.max() <= found.disparities.largest < 3 * truth.max()
    assert any("measured" in remark for remark in draft.remarks)
    assert "# reference" in draft.path.read_text()


def test_a_given_range_is_kept(folder: Path) -> None:
    write_scene_toml(folder, (-1.5, 24))
    assert load_scene(str(folder)).disparities == Range(-1.5, 24)
    with pytest.raises(UserError, match="empty"):
        write_scene_toml(folder, (5, 1), replace=True)


def test_views_are_listed_as_they_were_taken(tmp_path: Path, scene: Scene) -> None:
    for name, view in zip("ebadc", scene.views, strict=True):
        write_png(tmp_path / f"{name}.png", view)
    draft = write_scene_toml(tmp_path)
    np.testing.assert_array_equal(load_scene(str(tmp_path)).views, scene.views)
    assert any("not by their names" in remark for remark in draft.remarks)


def test_a_pair_named_the_wrong_way_round_is_put_right(tmp_path: Path, scene: Scene) -> None:
    write_png(tmp_path / "1.png", scene.views[3])
    write_png(tmp_path / "2.png", scene.views[2])
    write_scene_toml(tmp_path)
    np.testing.assert_array_equal(load_scene(str(tmp_path)).views, scene.views[2:4])


def test_truth_files_are_no_views_and_are_offered(folder: Path, scene: Scene) -> None:
    truth = scene.truth[scene.ref]
    (folder / "disp10.pfm").write_bytes(pfm_bytes(truth))
    write_png(folder / "truth9.png", np.rint(truth * 16).astype(np.uint8))
    write_png(folder / "mask10.png", np.ones((240, 320), np.uint8))
    write_png(folder / "thumbnail.png", scene.views[0][::4, ::4])
    (folder / "broken.png").write_bytes(b"nothing")
    (folder / "notes.txt").write_text("hello")
    draft = write_scene_toml(folder)
    found = load_scene(str(folder))
    assert found.n == 5
    np.testing.assert_array_equal(found.truth[2], truth)
    assert found.ref == 2
    text = draft.path.read_text()
    assert '# [truth."im9.png"]\n# file = "truth9.png"\n# scale' in text
    assert "mask10" not in text
    said = " ".join(draft.remarks)
    assert "thumbnail.png, 80x60 px" in said
    assert "broken.png" in said


def test_nothing_is_overwritten_unasked(folder: Path) -> None:
    (folder / "scene.toml").write_text("mine")
    with pytest.raises(UserError, match=r"a scene already: it holds scene\.toml; --force"):
        write_scene_toml(folder)
    assert (folder / "scene.toml").read_text() == "mine"
    write_scene_toml(folder, replace=True)
    assert load_scene(str(folder)).n == 5
    (folder / "scene.toml").unlink()
    (folder / "calib.txt").write_text("ndisp=20")
    with pytest.raises(UserError, match=r"calib\.txt"):
        write_scene_toml(folder)


def test_without_features_the_range_is_called_a_guess(tmp_path: Path) -> None:
    for name in ("a", "b"):
        write_png(tmp_path / f"{name}.png", np.full((60, 80, 3), 99, np.uint8))
    draft = write_scene_toml(tmp_path)
    assert any("A GUESS" in remark for remark in draft.remarks)
    assert "A GUESS" in draft.path.read_text()
    assert load_scene(str(tmp_path)).n == 2


def test_masks_among_views_are_left_out(folder: Path, scene: Scene) -> None:
    for number, region in enumerate(("occ", "disc")):
        write_png(folder / f"segment{number}.png", np.where(scene.regions[region], 255, 0).astype(np.uint8))
    draft = write_scene_toml(folder)
    assert tomllib.loads(draft.path.read_text())["views"] == [f"im{number}.png" for number in NUMBERS]
    assert sum("segment" in remark and "a mask" in remark for remark in draft.remarks) == 2
    assert "measured" in draft.remarks[-1]


def test_one_view_among_masks_is_too_few(tmp_path: Path, scene: Scene) -> None:
    write_png(tmp_path / "a.png", scene.views[0])
    write_png(tmp_path / "b.png", np.where(scene.regions["occ"], 255, 0).astype(np.uint8))
    with pytest.raises(UserError, match=r"at least two views .* found: a\.png"):
        write_scene_toml(tmp_path)
    assert not (tmp_path / "scene.toml").exists()


def test_random_dots_of_two_colours_are_views(tmp_path: Path) -> None:
    dots = np.random.default_rng(0).integers(0, 2, (60, 80, 1), np.uint8).repeat(3, 2) * 255
    for number in range(2):
        write_png(tmp_path / f"im{number}.png", np.roll(dots, -3 * number, axis=1))
    assert tomllib.loads(write_scene_toml(tmp_path).path.read_text())["views"] == ["im0.png", "im1.png"]


def test_a_picture_of_something_else_is_named(folder: Path, scene: Scene) -> None:
    other = load_scene(f"synthetic/fence[n=2 seed=7 size={scene.width}x{scene.height}]").views[0]
    write_png(folder / "zebra.png", other)
    assert any(
        "match in zebra.png: are these views of this scene?" in remark for remark in write_scene_toml(folder).remarks
    )


def test_ready_made_maps_are_no_views(folder: Path, scene: Scene) -> None:
    """Without a name that says so: in grey among coloured views, in colours, and in grey among grey ones."""
    grey = np.rint(scene.truth[scene.ref] * 20).astype(np.uint8)
    write_png(folder / "sgbm.png", grey)
    write_png(folder / "im7.png", cv2.applyColorMap(grey, cv2.COLORMAP_JET)[..., ::-1])
    draft = write_scene_toml(folder)
    assert tomllib.loads(draft.path.read_text())["views"] == [f"im{number}.png" for number in NUMBERS]
    assert "left out: sgbm.png, grey where the others are coloured, as maps and masks are" in draft.remarks
    assert "left out: im7.png, a map: it has plateaus, and no features of the others" in draft.remarks

    (folder / "im7.png").unlink()
    for number in NUMBERS:
        write_png(folder / f"im{number}.png", cv2.cvtColor(scene.views[number - 8], cv2.COLOR_RGB2GRAY))
    draft = write_scene_toml(folder, replace=True)
    assert tomllib.loads(draft.path.read_text())["views"] == [f"im{number}.png" for number in NUMBERS]
    assert any("sgbm.png, a map" in remark for remark in draft.remarks)


def test_views_below_one_another_are_turned(tmp_path: Path, scene: Scene) -> None:
    for number, view in zip(NUMBERS, scene.views, strict=True):  # a quarter clockwise: from the top
        cv2.imwrite(str(tmp_path / f"im{number}.jpg"), np.rot90(view, -1)[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 100])
    draft = write_scene_toml(tmp_path)
    assert tomllib.loads(draft.path.read_text())["vertical"]
    assert "the views were taken one below the other: vertical = true turns them" in draft.remarks
    found = load_scene(str(tmp_path))
    assert found.labels == ("8", "9", "10", "11", "12")
    assert np.abs(found.views.astype(int) - scene.views).mean() < 4
    assert found.disparities.largest < 3 * scene.truth[scene.ref].max()
    assert {finding.verdict for finding in check(found)} <= {"good", "note"}


@pytest.mark.parametrize(("kept", "positions"), [((0, 1, 3), [0, 1, 3]), ((0, 2, 5), [0, 1, 2.5])])
def test_uneven_steps_are_measured(tmp_path: Path, kept: tuple[int, ...], positions: list[float]) -> None:
    full = load_scene("synthetic/box[n=6 ref=2 size=320x240]")
    for view in kept:
        write_png(tmp_path / f"{view}.png", full.views[view])
    draft = write_scene_toml(tmp_path)
    assert tomllib.loads(draft.path.read_text())["positions"] == positions
    assert any("not taken at even steps" in remark for remark in draft.remarks)
    found, truth = load_scene(str(tmp_path)), full.truth[2] * (kept[1] - kept[0])
    assert truth.max() <= found.disparities.largest < 3 * truth.max()
    assert {finding.verdict for finding in check(found)} <= {"good", "note"}


def test_zeros_far_from_all_numbers_are_taken_for_unknown(folder: Path, scene: Scene) -> None:
    truth = np.where(np.arange(320) < 40, 0, scene.truth[scene.ref])
    (folder / "disp10.pfm").write_bytes(pfm_bytes(truth))
    draft = write_scene_toml(folder)
    assert (
        'file = "disp10.pfm"\n# scale = 1    # stored number of one pixel per view step\nunknown = 0'
        in draft.path.read_text()
    )
    (said,) = [remark for remark in draft.remarks if remark.startswith("disp10.pfm: ")]
    assert said.startswith("disp10.pfm: 9600 of 76800 numbers are 0 (12.5 %), and no other is nearer to it than 2.5")
    assert np.isnan(load_scene(str(folder)).truth[2][:, :40]).all()
    draft.path.write_text(draft.path.read_text().replace("\nunknown = 0", "\n#"))
    problems = [finding.text for finding in check(load_scene(str(folder))) if finding.verdict == "problem"]
    assert any("if 0 means unknown, write unknown = 0" in problem for problem in problems)


def test_names_that_need_quoting(tmp_path: Path, scene: Scene) -> None:
    for view, name in enumerate(['q"uote 1.png', "back\\slash 2.png", "déjà\u00a0vu 3.png", "a\ttab 4.png"]):
        write_png(tmp_path / name, scene.views[view])
    draft = write_scene_toml(tmp_path)
    assert any("'a\\ttab 4.png' holds a tab" in remark for remark in draft.remarks), "no view can be called so"
    assert load_scene(str(tmp_path)).n == 3


@pytest.mark.parametrize("names", [[], ["one.png"]])
def test_too_few_images_are_refused(tmp_path: Path, scene: Scene, names: list[str]) -> None:
    for name in names:
        write_png(tmp_path / name, scene.views[0])
    (tmp_path / "photo.WEBP").write_bytes(b"")
    with pytest.raises(UserError, match=r"too few images.*\.WEBP are not read: save them as PNG"):
        write_scene_toml(tmp_path)
    assert not (tmp_path / "scene.toml").exists()
    with pytest.raises(UserError, match="does not exist"):
        write_scene_toml(tmp_path / "none")


def test_a_folder_of_links_is_taken_or_refused_as_by_whoever_reads_the_scene(folder: Path, tmp_path: Path) -> None:
    (folder / "store").mkdir()
    for number in NUMBERS:  # within the folder, a link is a file as any other
        (folder / f"im{number}.png").rename(folder / "store" / f"{number}")
        (folder / f"im{number}.png").symlink_to(Path("store", str(number)))
    write_scene_toml(folder)
    assert load_scene(str(folder)).n == len(NUMBERS)
    (folder / "scene.toml").unlink()
    away = folder / "away"
    away.mkdir()
    for number in NUMBERS:
        (away / f"im{number}.png").symlink_to(folder / "store" / str(number))
    with pytest.raises(UserError, match=r"'im8.png' leads out of the folder .*: images and truth must lie in it"):
        write_scene_toml(away)
    assert not (away / "scene.toml").exists()
