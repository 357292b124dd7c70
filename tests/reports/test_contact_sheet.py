"""Contact sheets: everything that a scene has is on them."""

import cv2
import numpy as np
import pytest
from attrs import evolve
from scene_files import Layers

from matbench import load_scene
from matbench.reports.contact_sheet import SHOWN, WIDTH, contact_sheet
from matbench.scene import Range, Scene


def _decoded(png: bytes) -> np.ndarray:
    return cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR)[..., ::-1]


def _holds(sheet: np.ndarray, tile: np.ndarray) -> bool:
    """Is the picture anywhere on the sheet, as it is?"""
    score = cv2.matchTemplate(np.ascontiguousarray(sheet), np.ascontiguousarray(tile), cv2.TM_SQDIFF_NORMED)
    return bool(score.min() < 1e-3)


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene("synthetic/curved[n=3 size=160x120]")


def test_views_truth_and_regions_are_on_the_sheet(scene: Scene) -> None:
    sheet = _decoded(contact_sheet(scene))
    assert sheet.shape[1] == WIDTH
    view = cv2.resize(scene.views[0], (320, 240), interpolation=cv2.INTER_CUBIC)
    assert _holds(sheet, view[100:140, 100:160])
    assert not _holds(sheet, view[140:100:-1, 100:160]), "the comparison can fail"
    bare = _decoded(contact_sheet(evolve(scene, truth={}, regions={}, visible={})))
    no_regions = _decoded(contact_sheet(evolve(scene, regions={})))
    assert bare.shape[0] < no_regions.shape[0] < sheet.shape[0]


def test_whatever_regions_there_are_are_shown(scene: Scene) -> None:
    added = {f"seen_{k}": scene.regions["all"] for k in range(7)}
    more = evolve(scene, regions={**scene.regions, **added})
    assert _decoded(contact_sheet(more)).shape[0] > _decoded(contact_sheet(scene)).shape[0]


def test_the_same_scene_gives_the_same_bytes(scene: Scene) -> None:
    assert contact_sheet(scene) == contact_sheet(scene)


@pytest.mark.parametrize(("n", "height", "width"), [(2, 30, 40), (40, 12, 16), (3, 300, 20), (2, 8, 400)])
def test_scenes_of_any_shape_fit(n: int, height: int, width: int) -> None:
    views = np.random.default_rng(0).integers(0, 256, (n, height, width, 3), np.uint8)
    truth = {view: np.full((height, width), np.nan, np.float32) for view in range(n)}
    labels = tuple(map(str, range(n)))
    sheet = _decoded(contact_sheet(Scene("any $x_1$", views, labels, n - 1, Range(0, 1), truth, 1)))
    assert sheet.shape[1] == WIDTH
    assert SHOWN < 40


def test_a_damaged_row_or_name_is_drawn_as_text() -> None:
    world = Layers()
    views = np.stack([world.view(k) for k in range(2)])
    scene = Scene("$\\frac{ <b>", views, ("0", "1"), 0, Range(0, 1), {}, 1)
    assert contact_sheet(scene, row=0)
