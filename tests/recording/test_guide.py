"""The text panel of a recording."""

import numpy as np

from matbench.recording.blueprint import Contents, SlicePaths
from matbench.recording.guide import guide
from matbench.scene import Range, Scene


def scene(least: float = 1) -> Scene:
    truth = np.tile(np.linspace(least, least + 3, 6, dtype=np.float32), (4, 1))
    views = np.zeros((3, 4, 6, 3), np.uint8)
    return Scene("toy/box", views, ("im2", "im4", "im6"), 1, Range(least, least + 3), {1: truth}, 2.0)


def said(contents: Contents, least: float = 1, rows: tuple[int, ...] = (2,)) -> str:
    return " ".join(guide(scene(least), rows, contents).split())


def test_it_says_what_the_scene_is_and_what_its_colours_mean() -> None:
    text = said(Contents(title="m on toy/box"), rows=(1, 3))
    assert text.startswith("# m on toy/box toy/box: 3 views of 6x4 px, reference view im4")
    assert "2 view steps make the pair" in text
    assert "**Disparity**: 1 (dark blue, far) to 4 (yellow, near)" in text
    assert "**Epipolar slices** of row 1, 3:" in text


def test_perspective_is_true_where_it_can_be() -> None:
    assert "True perspective, up to scale." in said(Contents())
    text = said(Contents(), least=0)
    assert "True perspective" not in text
    assert "px were added to every disparity" in text


def test_channels_and_numbers_are_told_where_there_are_any() -> None:
    bare = said(Contents())
    assert "Similarity:" not in bare
    assert "told once" not in bare
    slices = SlicePaths(2, channels={"similarity": ["im2-im4", "im4-im6"], "visibility": ["im2"]})
    told = {"total": [1.25], "changed": [0.5, 0.1]}
    text = said(Contents(slices=[slices], told=told, error_rates={"all": [50.0, 12.345]}))
    assert "Similarity: red im2-im4, green im4-im6." in text
    assert "Visibility: red im2." in text
    assert "**total**, told once: 1.25" in text
    assert "changed" not in text, "it has a curve"
    assert "12.35 % in all" in text or "12.34 % in all" in text
