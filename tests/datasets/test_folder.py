"""One's own scenes: what a scene.toml may say, and how a folder may be named."""

from pathlib import Path

import cv2
import numpy as np
import own_scenes
import pytest
from own_scenes import MINIMAL, NAMES, TRUTH, TRUTHFUL, WORLD, refused, write
from scene_files import pfm_bytes, write_png

from matbench import load_scene
from matbench.datasets.folder import labels
from matbench.errors import UserError
from matbench.scene import Range
from matbench.scenes.catalogue import own_folder, select
from matbench.scenes.photo_consistency import together, warping_errors


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return own_scenes.folder(tmp_path)


def test_a_folder_of_views_is_a_scene(folder: Path) -> None:
    scene = load_scene(write(folder, MINIMAL))
    assert scene.name == str(folder)
    assert scene.labels == ("0", "1", "2")
    assert scene.ref == 1
    assert scene.disparities == Range(0, 8)
    assert scene.pair_steps == 1
    assert not scene.truth
    for step, view in enumerate(scene.views):
        np.testing.assert_array_equal(view, WORLD.view(step - 1))


@pytest.mark.parametrize(
    "facts",
    [
        "file = 'grey8.png'\nscale = 16\nunknown = 0",
        "file = 'grey8.pgm'\nscale = 16.0\nunknown = 0\nencoding = 'grey8'",
        "file = 'grey16.png'\nscale = 4096\nunknown = 0\nencoding = 'grey16'",
        "file = 'grey16.pgm'\nscale = 4096\nunknown = 0",
        "file = 'map.pfm'",
        "file = 'map.pfm'\nscale = 1\nencoding = 'pfm'",
        "file = 'map0.pfm'\nunknown = 0",
    ],
)
@pytest.mark.parametrize("view", ["middle", "'middle.png'"])
def test_truth_in_every_encoding(folder: Path, facts: str, view: str) -> None:
    scene = load_scene(write(folder, f"{MINIMAL}[truth.{view}]\n{facts}\n"))
    assert list(scene.truth) == [1]
    assert np.isnan(scene.truth[1][:3]).all()
    np.testing.assert_array_equal(scene.truth[1][3:], TRUTH[3:])
    assert scene.regions["all"].sum() == TRUTH[3:].size


def test_reference_and_pair(folder: Path) -> None:
    truth = "[truth.left]\nfile = 'map.pfm'\n[truth.middle]\nfile = 'map.pfm'\n"
    text = f"{MINIMAL}pair_steps = 2\nreference = 'left.png'\n{truth}"
    scene = load_scene(write(folder, text))
    assert (scene.ref, scene.pair_steps) == (0, 2)
    refused(folder, text.replace("'left.png'\n", "'middle'\n", 1), "pair_steps")
    assert load_scene(write(folder, text) + "[views=0+2]").pair_steps == 1
    with pytest.raises(UserError, match="unknown option"):
        load_scene(f"{folder}[size=half]")


def test_views_at_uneven_positions(folder: Path) -> None:
    text = f"{MINIMAL}positions = [10, 11, 12.5]\nreference = 'middle'\n"
    scene = load_scene(write(folder, text))
    assert (scene.positions, scene.pair_steps) == ((0, 1, 2.5), 1)
    two = load_scene(write(folder, text) + "[views=1+2]")
    assert (two.is_even, two.disparities, two.pair_steps) == (True, Range(0, 12), 1 / 1.5)
    assert load_scene(write(folder, text + "pair_steps = 1.5")).pair_steps == 1.5
    assert load_scene(write(folder, f"{MINIMAL}positions = [0, 1, 2]")).is_even


def test_views_below_one_another_are_turned(tmp_path: Path) -> None:
    for step, name in enumerate(NAMES):
        write_png(tmp_path / name, WORLD.view(0, step - 1))
    (tmp_path / "map.pfm").write_bytes(pfm_bytes(TRUTH))
    seen = np.where(np.arange(96) < 48, 255, 128) * np.ones((80, 1))
    write_png(tmp_path / "seen.png", seen.astype(np.uint8))
    truth = "[truth.'middle.png']\nfile = 'map.pfm'\nmask = 'seen.png'\n"
    scene = load_scene(write(tmp_path, f"{MINIMAL}vertical = true\n{truth}"))
    np.testing.assert_array_equal(scene.views[1], np.rot90(WORLD.view(0)))
    np.testing.assert_array_equal(scene.truth[1], np.rot90(TRUTH))
    np.testing.assert_array_equal(scene.regions["nonocc"], np.rot90(seen == 255))
    error = together(warping_errors(scene))
    assert error is not None
    assert error.at(0) < 0.5 * min(error.at(-1), error.at(1))


def test_numbers_of_truth_in_any_file(folder: Path) -> None:
    truth = np.where(np.arange(80)[:, None] < 3, np.nan, TRUTH)
    np.save(folder / "map.npy", truth)
    np.savez(folder / "map.npz", truth * 4)
    cv2.imwrite(str(folder / "map.tif"), np.nan_to_num(truth).astype(np.float32))
    packed = np.nan_to_num(truth).astype(np.int64) << 14
    write_png(folder / "packed.png", np.stack([packed >> 16, (packed >> 8) & 255, packed & 255], 2).astype(np.uint8))
    for facts in (
        "'map.npy'",
        "'map.npz'\nscale = 4",
        "'map.tif'\nunknown = 0",
        "'packed.png'\nencoding = 'sintel'\nunknown = 0",
    ):
        scene = load_scene(write(folder, f"{MINIMAL}[truth.middle]\nfile = {facts}"))
        np.testing.assert_array_equal(scene.truth[1], truth)
    np.save(folder / "map.npy", TRUTH[1:])
    refused(folder, f"{MINIMAL}[truth.middle]\nfile = 'map.npy'", "96x79 px, not 96x80 as its view")


def test_views_of_other_formats(folder: Path) -> None:
    fine = [cv2.IMWRITE_JPEG_QUALITY, 98, cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444]
    cv2.imwrite(str(folder / "left.jpg"), WORLD.view(-1)[..., ::-1], fine)
    cv2.imwrite(str(folder / "right.tif"), WORLD.view(1)[..., ::-1])
    write_png(folder / "middle.png", WORLD.view(0).astype(np.uint16) * 257)
    scene = load_scene(write(folder, "views = ['left.jpg', 'middle.png', 'right.tif']\ndisparities = [0, 8]"))
    np.testing.assert_array_equal(scene.views[1:], [WORLD.view(0), WORLD.view(1)])
    assert np.abs(scene.views[0].astype(int) - WORLD.view(-1)).mean() < 3


def test_scattered_truth_is_noticed_or_said(folder: Path) -> None:
    thin = np.where(np.random.default_rng(0).random(TRUTH.shape) < 0.2, TRUTH, np.inf)
    (folder / "thin.pfm").write_bytes(pfm_bytes(thin))
    text = f"{MINIMAL}[truth.middle]\nfile = 'thin.pfm'\n"
    assert list(load_scene(write(folder, text)).scored_regions) == ["all"]
    assert "occ" in load_scene(write(folder, text + "sparse = false")).regions
    dense = f"{MINIMAL}[truth.middle]\nfile = 'map.pfm'\n"
    assert "occ" in load_scene(write(folder, dense)).regions
    assert list(load_scene(write(folder, dense + "sparse = true")).scored_regions) == ["all"]


def test_labels_are_the_numbers_that_files_have() -> None:
    assert labels(["im2.png", "im6.png", "im10.png"]) == ("2", "6", "10")
    assert labels(["scene1.row3.col1.ppm", "scene1.row3.col2.ppm"]) == ("1", "2")
    assert labels(["im6.png", "im2.png"]) == ("0", "1"), "they must increase"
    assert labels(["a1.png", "b2.png"]) == ("0", "1"), "only numbers may differ"
    assert labels(["1a1.png", "2a2.png"]) == ("0", "1")


def test_a_folder_is_named_as_any_path(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(folder, MINIMAL)
    monkeypatch.chdir(folder.parent)
    monkeypatch.setenv("HOME", str(folder.parent))
    folder.rename("desk")
    for name in (
        "desk",
        "./desk",
        "desk/",
        "../" + folder.parent.name + "/desk",
        "folder/desk",
        "~/desk",
        str(Path("desk").resolve()),
    ):
        scene = load_scene(name)
        assert scene.n == 3
        assert load_scene(scene.name).digest == scene.digest, "its name loads it again"
    assert load_scene("desk").name == load_scene("folder/desk/").name == "./desk"
    assert load_scene("desk[views=0:2 ref=0]").name == "./desk[ref=0 views=0:2]"
    assert select("./d*").names == ("./desk",)
    assert [load_scene(name).name for name in select("d*[views=1:3]").names] == ["./desk[views=1:3]"]
    held = load_scene("desk[predict=right]")
    assert (held.name, held.n) == ("./desk[predict=right]", 2)
    Path("synthetic").mkdir()
    assert own_folder("synthetic") is None, "a dataset's name is a dataset"
    assert own_folder("./synthetic") == "./synthetic"


def test_regions_of_ones_own_are_masks_of_a_view(folder: Path) -> None:
    mask = np.zeros(TRUTH.shape, np.uint8)
    mask[5:20, 10:30] = 7
    write_png(folder / "planes.png", mask)
    write_png(folder / "seen.png", 255 - mask)
    regions = "[regions.'middle.png']\nplanes = 'planes.png'\nnonocc = 'seen.png'\n"
    scene = load_scene(write(folder, "metrics = 'kitti'\n" + MINIMAL + TRUTHFUL + regions))
    assert scene.metrics == "kitti"
    np.testing.assert_array_equal(scene.regions["planes"], mask > 0)
    np.testing.assert_array_equal(scene.regions["nonocc"], mask < 255)
    assert {"all", "occ", "disc"} <= set(scene.regions)
