"""Maps for a paper: what they show is what the run holds."""

from pathlib import Path

import numpy as np
import pytest
from figures import SMALL, figured, made
from typing_commands import run as matbench

from matbench import load_scene
from matbench.errors import UserError
from matbench.recording import coloring
from matbench.reports import map_figure
from matbench.runs.store import Store


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return figured(tmp_path_factory)


def test_maps_are_those_of_the_run(run: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    line = ["figure", "maps", str(run), "-a", "materiality", "okutomi", "--errors", "-o", str(tmp_path / "three")]
    assert matbench(capsys, *line)[0] == 0
    caption = (tmp_path / "three.txt").read_text()
    assert SMALL in caption
    assert "(c) materiality[preset=paper passes=3]; (d) its errors" in caption
    assert "flat" not in caption
    scene, store = load_scene(SMALL), Store(run)
    cell = next(c for c in store.plan().cells if c.method.algorithm == "okutomi_kanade")
    stored = store.disparity(cell)[scene.ref]
    drawn = map_figure.draw(map_figure.Maps((scene,), ("ok",), {("ok", SMALL): stored}))
    shown = [axis.images[0].get_array() for axis in drawn.figure.axes]
    ends = coloring.disparity_ends(scene)
    assert np.array_equal(shown[0], scene.views[scene.ref])
    assert np.array_equal(shown[1], coloring.truth_colors(scene.truth[scene.ref], ends))
    assert np.array_equal(shown[2], coloring.disparity_colors(stored, ends))


def test_many_scenes_go_on_in_the_next_line_until_the_page_is_full() -> None:
    scenes = tuple(made(f"made/{i}") for i in range(6))
    found = {("m", scene.name): scene.truth[0] for scene in scenes[1:]}
    drawn = map_figure.draw(map_figure.Maps(scenes, ("m",), found))
    assert len(drawn.figure.axes) == 18
    assert drawn.figure.get_figwidth() == 3.25
    assert "Without a map: m on made/0." in drawn.caption
    assert [text.get_text() for text in drawn.figure.texts].count("(c)") == 2
    with pytest.raises(UserError, match="more than a page holds"):
        map_figure.draw(map_figure.Maps(scenes, tuple("abcdefghijklmnop"), {}), errors=True)
