"""Light fields: rows and columns of 9x9 views, signed truth, ranges."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from real import Real
from scene_files import Layers, check_one_line, pfm_bytes, write_png

from matbench import load_scene
from matbench.datasets.hci import RANGE, SCENES, read_range
from matbench.errors import UserError
from matbench.scene import Range, Scene
from matbench.scenes.catalogue import listings, select
from matbench.scenes.photo_consistency import together, warping_errors

WORLD = Layers()


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A light field, all 81 views of it, with truth of every view but those of the first row."""
    root = tmp_path_factory.mktemp("data")
    folder = root / "hci" / "training" / "boxes"
    folder.mkdir(parents=True)
    for down in range(9):
        for across in range(9):
            place = 9 * down + across
            write_png(folder / f"input_Cam{place:03}.png", WORLD.view(across - 4, down - 4))
            if down:
                truth = pfm_bytes(WORLD.truth(across - 4, down - 4), little=place % 2 == 0)
                (folder / f"gt_disp_lowres_Cam{place:03}.pfm").write_bytes(truth)
    (folder / "gt_disp_lowres.pfm").write_bytes(pfm_bytes(WORLD.truth()))
    return root


def _errors(scene: Scene, truth: np.ndarray | None = None) -> tuple[float, ...]:
    error = together(warping_errors(scene, truth))
    assert error is not None
    return error.mean


def _is_explained(scene: Scene) -> bool:
    less, zero, more = _errors(scene)
    reversed_sign = _errors(scene, -scene.truth[scene.ref])[1]
    return zero < 0.5 * min(less, more) and zero < 0.2 * reversed_sign


@pytest.mark.parametrize("row", [1, 4, 8])
def test_a_row_is_explained_by_its_truth(root: Path, row: int) -> None:
    scene = load_scene(f"hci/boxes[row={row}]", root)
    assert scene.n == 9
    assert scene.ref == 4
    assert scene.labels == tuple("012345678")
    np.testing.assert_array_equal(scene.views[2], WORLD.view(-2, row - 4))
    np.testing.assert_array_equal(scene.truth[4], WORLD.truth(0, row - 4))
    assert _is_explained(scene)


@pytest.mark.parametrize("column", [0, 4, 7])
def test_a_column_turned_is_explained_by_its_truth(root: Path, column: int) -> None:
    scene = load_scene(f"hci/boxes[column={column}]", root)
    assert scene.views.shape == (9, 96, 80, 3)
    for y, x in ((0, 0), (10, 70), (79, 95), (40, 50)):
        np.testing.assert_array_equal(
            scene.views[:, 95 - x, y], [WORLD.view(column - 4, k - 4)[y, x] for k in range(9)]
        )
        assert scene.truth[4][95 - x, y] == WORLD.truth(column - 4, 0)[y, x]
    assert _is_explained(scene)


def test_turned_the_other_way_it_would_not_be_explained(root: Path) -> None:
    scene = load_scene("hci/boxes[column=4]", root)
    clockwise = Scene(
        name="x",
        views=scene.views[:, ::-1, ::-1],
        labels=scene.labels,
        ref=4,
        disparities=scene.disparities,
        truth={4: scene.truth[4][::-1, ::-1]},
        pair_steps=1,
    )
    assert not _is_explained(clockwise)


def test_views_are_chosen_and_truth_follows(root: Path) -> None:
    scene = load_scene("hci/boxes[column=4 views=0:9:2 ref=6]", root)
    assert scene.labels == ("0", "2", "4", "6", "8")
    assert scene.ref == 3
    assert scene.disparities == RANGE.scaled(2)
    np.testing.assert_array_equal(scene.truth[2], 2 * np.rot90(WORLD.truth()))
    assert _is_explained(scene)


def test_a_row_without_truth_can_be_looked_at(root: Path) -> None:
    scene = load_scene("hci/boxes[row=0]", root)
    assert scene.truth == {}
    assert scene.regions == {}
    assert scene.ref == 4


def test_antinous_is_explained_by_its_truth(real: Real) -> None:
    root = real("hci/antinous")
    scene = load_scene("hci/antinous", root)
    assert scene.views.shape == (9, 512, 512, 3)
    assert scene.disparities == RANGE, "no parameters.cfg"
    assert -3.2 < scene.truth[4].min() < -3.1
    assert 2.6 < scene.truth[4].max() < 2.7
    assert _is_explained(scene)
    assert {"all", "nonocc", "occ", "disc", "textureless"} <= set(scene.regions)
    with pytest.raises(UserError, match=r"input_Cam\d+\.png is missing"):
        load_scene("hci/antinous[column=4]", root)


@pytest.mark.parametrize(
    ("options", "labels", "ref"),
    [
        ("views=3", "048", "4"),
        ("baseline=2", "345", "4"),
        ("views=2 baseline=3", "47", "4"),
        ("ref=1 views=3", "147", "1"),
    ],
)
def test_views_are_chosen_by_number_and_baseline(root: Path, options: str, labels: str, ref: str) -> None:
    scene = load_scene(f"hci/boxes[{options}]", root)
    assert "".join(scene.labels) == labels
    assert scene.labels[scene.ref] == ref


def test_the_range_is_searched_that_is_asked_for(root: Path) -> None:
    assert load_scene("hci/boxes[disparities=-1:2.5]", root).disparities == Range(-1, 2.5)


def test_a_light_field_without_truth_is_there_but_not_scored(root: Path, tmp_path: Path) -> None:
    folder = tmp_path / "hci" / "test" / "herbs"
    folder.mkdir(parents=True)
    for place in range(36, 45):
        write_png(folder / f"input_Cam{place:03}.png", WORLD.view(place - 40))
    with pytest.raises(UserError, match=r"hci/herbs: no ground truth"):
        select("hci/h*", tmp_path)
    assert select("hci/h*[predict=left]", tmp_path).names == ("hci/herbs[predict=left]",)
    with pytest.raises(UserError) as caught:
        select("hci/d*", tmp_path)
    assert "--data" in str(caught.value)
    assert "matbench fetch" not in str(caught.value), "it brings no light fields"
    known = listings(tmp_path)
    assert [name for name, found in known.items() if name.startswith("hci/") and not getattr(found, "truth", True)] == [
        f"hci/{name}" for name in ("bedroom", "bicycle", "herbs", "origami")
    ]


def test_listed_and_selected(root: Path) -> None:
    known = {name: found for name, found in listings(root).items() if name.startswith("hci/")}
    assert len(known) == sum(len(names.split()) for names in SCENES.values()) == 28
    assert [name for name, found in known.items() if getattr(found, "present", False)] == ["hci/boxes"]
    assert select("hci/*", root).names == ("hci/boxes",)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("hci/boxs", ["unknown scene 'boxs' of hci", "'boxes'"]),
        ("hci/dino", ["hci/dino is not in", "training"]),
        ("hci/../boxes", ["unknown scene"]),
        ("hci/boxes[row=9]", ["row=9", "0 (top) to 8"]),
        ("hci/boxes[row=-1]", ["row=-1"]),
        ("hci/boxes[column=x]", ["column=x", "left"]),
        ("hci/boxes[row=1 column=1]", ["cannot both"]),
        (
            "hci/boxes[size=half]",
            ["unknown option 'size' of hci/boxes", "baseline, column, disparities, predict, ref, row, views"],
        ),
        ("hci/boxes[row=2 views=8:9]", ["at least two"]),
    ],
)
def test_what_does_not_exist_is_refused(root: Path, name: str, words: list[str]) -> None:
    with pytest.raises(UserError) as caught:
        load_scene(name, root)
    assert all(word in str(caught.value) for word in words), caught.value
    assert "\n" not in str(caught.value)


@pytest.fixture
def cfg(root: Path):
    path = root / "hci/training/boxes/parameters.cfg"
    yield path
    path.unlink(missing_ok=True)


def test_the_range_is_that_of_parameters_cfg(root: Path, cfg: Path) -> None:
    cfg.write_text("[intrinsics]\nfstop = 100.0\n[meta]\nscene = boxes\ndisp_min = -2.2\ndisp_max = 1.4\nnote = 100%\n")
    assert load_scene("hci/boxes", root).disparities == Range(-2.2, 1.4)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "disp_min"),
        ("[meta]\ndisp_min = -1\n", "disp_max"),
        ("[meta]\ndisp_min = one\ndisp_max = 2\n", "'one'"),
        ("[meta]\ndisp_min = nan\ndisp_max = 2\n", "finite"),
        ("[meta]\ndisp_min = 3\ndisp_max = 2\n", "empty"),
        ("disp_min = 3\n", "cannot be read"),
        ("[meta]\ndisp_min=1\ndisp_min=2\n", "cannot be read"),
        ("[meta]\ndisp_min = %(disp_min)s\ndisp_max = 2\n", "disp_min"),
        ("[meta]\n" + "x = 1\n" * 20000, "bytes"),
    ],
)
def test_a_malformed_cfg_is_refused(root: Path, cfg: Path, text: str, words: str) -> None:
    cfg.write_text(text)
    with pytest.raises(UserError, match=r"parameters\.cfg") as caught:
        load_scene("hci/boxes", root)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(
    st.one_of(
        st.binary(max_size=80),
        st.text(max_size=60).map(lambda text: f"[meta]\ndisp_min = {text}\ndisp_max = 3\n".encode()),
        st.text("[]=:;#%()\n\t meta.disp_min019", max_size=80).map(str.encode),
    )
)
def test_any_cfg_gives_a_finite_range_or_one_line(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "parameters.cfg").write_bytes(content)
    try:
        found = read_range(tmp_path)
    except UserError as error:
        check_one_line(error)
    else:
        assert np.isfinite([found.least, found.largest]).all()


def test_the_border_and_the_masks_are_regions(root: Path, tmp_path: Path) -> None:
    """Of the centre view, turned with it; a view without masks has the border only."""
    folder = tmp_path / "hci" / "training" / "boxes"
    shutil.copytree(root / "hci" / "training" / "boxes", folder)
    plain = load_scene("hci/boxes", tmp_path)
    inner = plain.regions["inner"]
    assert plain.metrics == "hci"
    assert inner[15:-15, 15:-15].all()
    assert inner.sum() == (plain.height - 30) * (plain.width - 30)
    mask = np.zeros((plain.height, plain.width), np.uint8)
    mask[10:40, 20:60] = 255
    write_png(folder / "mask_planes_lowres.png", mask)
    row, column = (load_scene(f"hci/boxes{options}", tmp_path) for options in ("", "[column=4]"))
    np.testing.assert_array_equal(row.regions["planes"], (mask > 0) & inner)
    np.testing.assert_array_equal(column.regions["planes"], np.rot90((mask > 0) & inner))
    assert set(row.regions) - set(plain.regions) == {"planes"}
    assert row.digest == plain.digest, "no method sees it, so nothing is computed again"
    assert row.truth_digest != plain.truth_digest
    assert "planes" not in load_scene("hci/boxes[row=3]", tmp_path).regions
    write_png(folder / "mask_planes_lowres.png", mask[:-1])
    with pytest.raises(UserError, match=r"mask_planes_lowres\.png") as caught:
        load_scene("hci/boxes", tmp_path)
    check_one_line(caught.value)
