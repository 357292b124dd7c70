"""Each way in which a map is often meant otherwise is found by measuring."""

import numpy as np
import pytest
from attrs import evolve

from matbench import load_scene
from matbench.files.maps import Reading
from matbench.scene import Scene
from matbench.scenes.maps_check import check, wrong


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene("synthetic/curved[size=96x72]")


def truth(scene: Scene, view: int | None = None) -> np.ndarray:
    return np.array(scene.truth[scene.ref if view is None else view] * np.float32(scene.pair_steps))


def test_truth_is_good(scene: Scene) -> None:
    found = check(truth(scene), scene, Reading())
    assert (found.verdict, found.text[:5]) == ("good", "0.0 %")


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda t: t[::-1], "upside down"),
        (lambda t: t[:, ::-1], "mirrored"),
        (lambda t: -t, "with sign=-1"),
        (lambda t: 256 * t, "with scale=256"),
        (lambda t: 16 * t, "with scale=16"),
        (lambda t: -16 * t, "with scale=16 sign=-1"),
    ],
)
def test_what_it_is_instead(spoil, said, scene: Scene) -> None:  # type: ignore[no-untyped-def]
    found = check(np.ascontiguousarray(spoil(truth(scene))), scene, Reading())
    assert found.verdict == "problem"
    assert said in found.text
    assert "only 0.0 %" in found.text


def test_pixels_of_a_view_step_are_told_where_the_pair_is_wider(scene: Scene) -> None:
    assert scene.pair_steps > 1
    found = check(np.array(scene.truth[scene.ref]), scene, Reading())
    assert "unit=step" in found.text
    assert check(np.array(scene.truth[scene.ref]), scene, Reading(unit="step")).verdict == "good"


def test_the_map_of_the_other_view(scene: Scene) -> None:
    scene = load_scene("synthetic/thin")
    other = scene.ref + round(scene.pair_steps)
    assert other in scene.truth
    found = check(truth(scene, other), scene, Reading())
    assert "it is that view's map" in found.text
    assert scene.labels[other] in found.text


def test_a_bad_map_is_only_bad(scene: Scene) -> None:
    noise = np.random.default_rng(0).uniform(0, 20, (scene.height, scene.width)).astype(np.float32)
    assert check(noise, scene, Reading()).verdict == "note"


def test_sizes_are_told(scene: Scene) -> None:
    cut = check(truth(scene)[2:-2, 3:-3], scene, Reading())
    assert cut.text == "90x68 px, its view 96x72: crop=centre, if its borders were cut off evenly"
    assert "very same pixels" in check(np.zeros((200, 300), np.float32), scene, Reading()).text


def test_unknown_pixels_are_wrong(scene: Scene) -> None:
    half = truth(scene)
    half[:, ::2] = 0
    assert wrong(Reading(unknown=0).disparities(half, scene.pair_steps), scene) == pytest.approx(50, abs=2)


def test_without_truth_only_the_size_is_looked_at(scene: Scene) -> None:
    blind = evolve(scene, truth={}, regions={})
    found = check(truth(scene), blind, Reading())
    assert (found.verdict, found.text) == ("unknown", "96x72 px, as its view; without truth, no more can be told")
    assert check(truth(scene)[:-1], blind, Reading()).verdict == "problem"


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_map_without_any_value_is_told(value: float, scene: Scene) -> None:
    found = check(np.full((72, 96), value, np.float32), scene, Reading())
    assert (found.verdict, found.text) == ("problem", "96x72 px, but no pixel has a value: all are NaN or infinite")
    blind = evolve(scene, truth={}, regions={})
    assert check(np.full((72, 96), value, np.float32), blind, Reading()).verdict == "problem"


def test_a_map_of_the_number_of_no_answer_alone_is_told(scene: Scene) -> None:
    found = check(np.zeros((72, 96), np.float32), scene, Reading(unknown=0))
    assert found.text.endswith("no pixel has a value: all are NaN, infinite or the unknown=0")


@pytest.mark.filterwarnings("error")
def test_a_map_of_what_can_be_no_disparity_is_told(scene: Scene) -> None:
    found = check(np.full((72, 96), 3e38, np.float32), scene, Reading())
    assert found.verdict == "problem"
    assert found.text.endswith("that can be one: the smallest is 3e+38 px, the view 96 px wide")
    with_one = truth(scene)
    with_one[1:] = 3e38
    assert check(with_one, scene, Reading()).verdict == "note", "some may be wrong"
