"""A pair in Middlebury's layout since 2014."""

from pathlib import Path

import dataset_layouts
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scene_files import CALIB, Layers, check_one_line, write_pair, write_png

from matbench import load_scene
from matbench.datasets.pair import pair
from matbench.errors import UserError
from matbench.scene import Range
from matbench.scenes.photo_consistency import together, warping_errors

WORLD = Layers(near=9.5, far=3.25)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    folder = tmp_path / "Adirondack-imperfect"
    write_pair(folder, WORLD)
    return folder


def test_a_folder_of_the_layout_is_a_scene_of_two_views(folder: Path) -> None:
    scene = load_scene(str(folder))
    assert (scene.n, scene.ref, scene.pair_steps, scene.labels) == (2, 0, 1, ("0", "1"))
    assert scene.disparities == Range(0, 23), "ndisp levels from 0; vmin and vmax are the truth's"
    np.testing.assert_array_equal(scene.views[1], WORLD.view(1))
    assert np.isnan(scene.truth[0][:2]).all()
    np.testing.assert_array_equal(scene.truth[0][2:], WORLD.truth(0)[2:])
    for ref in (0, 1):
        error = together(warping_errors(load_scene(f"{folder}[ref={ref}]")))
        assert error is not None
        assert error.at(0) < 0.5 * min(error.at(-1), error.at(1))


def test_truth_of_the_right_view_need_not_be_there(folder: Path) -> None:
    (folder / "disp1.pfm").unlink()
    assert list(load_scene(str(folder)).truth) == [0]
    (folder / "disp0.pfm").unlink()
    assert not load_scene(str(folder)).truth


def test_a_scene_toml_beside_it_wins(folder: Path) -> None:
    (folder / "scene.toml").write_text("views = ['im0.png', 'im1.png']\ndisparities = [2, 12]\n")
    assert load_scene(str(folder)).disparities == Range(2, 12)


def test_a_mask_is_the_region_that_it_shows(tmp_path: Path) -> None:
    folder = dataset_layouts.eth3d(tmp_path / "delivery_area_1l")
    scene = load_scene(str(folder))
    assert scene.disparities == Range(0, 23), "ndisp=24.0"
    np.testing.assert_array_equal(scene.truth[0], dataset_layouts.truth())
    np.testing.assert_array_equal(scene.regions["nonocc"], dataset_layouts.seen())
    np.testing.assert_array_equal(scene.regions["occ"], ~dataset_layouts.seen())
    write_png(folder / "mask0nocc.png", np.full((80, 96), 7, np.uint8))
    with pytest.raises(UserError, match=r"mask0nocc\.png has other levels than 0, 128 and 255"):
        load_scene(str(folder))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (CALIB.replace("ndisp=24\n", ""), ["lacks ndisp", "ndisp=280"]),
        (CALIB.replace("ndisp=24", "ndisp=0"), ["ndisp='0'"]),
        (CALIB.replace("ndisp=24", "ndisp=-3"), ["ndisp='-3'"]),
        (CALIB.replace("ndisp=24", "ndisp=24.5"), ["ndisp='24.5'"]),
        (CALIB.replace("ndisp=24", "ndisp=nan"), ["ndisp='nan'"]),
        (CALIB.replace("ndisp=24", "ndisp=99999999999"), ["ndisp="]),
        (CALIB.replace("width=96", "width=2964"), ["96x80", "2964x80"]),
        (CALIB.replace("height=80\n", ""), ["lacks height"]),
        ("", ["lacks ndisp"]),
        ("x" * 70000, ["bytes"]),
    ],
)
def test_a_malformed_calibration_is_refused(folder: Path, text: str, words: list[str]) -> None:
    (folder / "calib.txt").write_text(text)
    with pytest.raises(UserError) as caught:
        load_scene(str(folder))
    assert all(word in str(caught.value) for word in words), caught.value
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["im1.png", "disp0.pfm"])
def test_links_that_lead_out_are_refused(folder: Path, name: str) -> None:
    (folder / name).rename(folder.parent / name)
    (folder / name).symlink_to(folder.parent / name)
    with pytest.raises(UserError, match="leads out of the folder"):
        load_scene(str(folder))


def test_a_missing_view_is_named(folder: Path) -> None:
    (folder / "im1.png").unlink()
    with pytest.raises(UserError, match=r"im1\.png is missing"):
        load_scene(str(folder))


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(st.one_of(st.binary(max_size=80), st.text("ndispwth=\n 0123456789", max_size=60).map(str.encode)))
def test_any_calibration_gives_a_range_or_one_line(folder: Path, content: bytes) -> None:
    (folder / "calib.txt").write_bytes(content)
    try:
        found = pair("x", folder)
    except UserError as error:
        check_one_line(error)
    else:
        assert 0 <= found.disparities.largest < 10**6
