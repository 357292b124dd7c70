"""Checking a scene: each fault is told, and nothing is told of a scene without one."""

from collections.abc import Callable

import numpy as np
import pytest
from attrs import evolve
from real import Real

from matbench import load_scene
from matbench.scene import Range, Scene
from matbench.scenes.alignment import match, places, rows
from matbench.scenes.scene_check import Observation, Verdict, check, conclusion


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene("synthetic/box[n=6 size=320x240]")


def _found(scene: Scene) -> dict[str, Observation]:
    return {finding.topic: finding for finding in check(scene)}


def _only_problem(scene: Scene, topic: str, *words: str) -> None:
    problems = [finding for finding in check(scene) if finding.verdict == "problem"]
    assert topic in {finding.topic for finding in problems}
    text = next(finding.text for finding in problems if finding.topic == topic)
    assert all(word in text for word in words), text


def _shifted(view: np.ndarray, down: float, turn: float = 0.0) -> np.ndarray:
    import cv2

    height, width = view.shape[:2]
    matrix = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), turn, 1.0)
    matrix[1, 2] += down
    return cv2.warpAffine(view, matrix, (width, height), flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT)


@pytest.mark.parametrize("name", ["synthetic/box", "synthetic/curved", "synthetic/weak", "synthetic/curved[n=2]"])
def test_a_good_scene_has_no_problem(name: str) -> None:
    assert {finding.verdict for finding in check(load_scene(name))} <= {"good", "unknown"}


@pytest.mark.parametrize(
    "name", ["middlebury2001/tsukuba", "middlebury2001/sawtooth", "middlebury2006/Plastic", "hci/antinous"]
)
def test_real_scenes_have_no_problem(real: Real, name: str) -> None:
    found = list(check(load_scene(name, real(name))))
    assert {finding.verdict for finding in found} == {"good"}, found
    assert {"order", "shift", "rows"} < {finding.topic for finding in found}


@pytest.mark.parametrize(
    ("shuffled", "right"), [([0, 3, 2, 1, 4, 5], "0, 3, 2, 1, 4, 5"), ([5, 3, 4, 2, 0, 1], "4, 5, 3, 1, 2, 0")]
)
def test_views_in_the_wrong_order_are_named_in_the_right_one(scene: Scene, shuffled: list[int], right: str) -> None:
    wrong = evolve(scene, views=scene.views[shuffled], truth={}, visible={}, regions={}, ref=2)
    found = _found(wrong)
    assert found["order"].verdict == "problem"
    assert found["order"].text.endswith(f"list {right}")
    assert found["shift"].verdict == "good"


def test_views_from_right_to_left_are_told(scene: Scene) -> None:
    wrong = evolve(scene, views=scene.views[::-1], ref=5 - scene.ref, truth={}, visible={}, regions={})
    found = _found(wrong)
    assert found["order"].verdict == "good"
    assert found["shift"].verdict == "problem"
    assert "the wrong way" in found["shift"].text


def test_a_missing_view_between_two_is_told(scene: Scene) -> None:
    kept = [0, 1, 2, 4, 5]
    wrong = evolve(scene, views=scene.views[kept], labels=tuple("01245"), ref=1, truth={}, visible={}, regions={})
    finding = _found(wrong)["order"]
    assert finding.verdict == "problem"
    assert "not evenly spaced" in finding.text


def test_a_range_that_does_not_hold_the_scene_is_told(scene: Scene) -> None:
    wrong = evolve(scene, disparities=Range(0, 3), truth={scene.ref: scene.truth[scene.ref]})
    found = [finding for finding in check(wrong) if finding.verdict == "problem"]
    assert [finding.topic for finding in found] == ["shift", f"truth of {scene.ref}"]
    assert all("outside the range 0..3" in finding.text for finding in found)


def test_a_view_of_something_else_is_told_and_not_summed_up_as_good(scene: Scene) -> None:
    views = scene.views.copy()
    views[5] = load_scene("synthetic/fence[n=2 seed=7 size=320x240]").views[0]
    found = list(check(evolve(scene, views=views, truth={}, visible={}, regions={})))
    order = next(finding for finding in found if finding.topic == "order")
    assert order.verdict == "unknown"
    assert "in 5;" in order.text
    said, is_shown = conclusion(found)
    assert not is_shown
    assert said.startswith("not confirmed: order could not")


@pytest.mark.parametrize("n", [2, 3])
def test_one_picture_twice_is_told(n: int) -> None:
    scene = load_scene(f"synthetic/box[n={n}]")
    same = evolve(scene, views=scene.views[[0, 0, *range(2, n)]], truth={}, visible={}, regions={})
    problem = next(finding for finding in check(same) if finding.topic == "views")
    assert problem == Observation("views", "problem", "0, 1 are one and the same picture")


@pytest.mark.parametrize("n", [2, 3])
def test_nothing_is_known_of_blank_pictures(n: int) -> None:
    scene = load_scene(f"synthetic/box[n={n} size=64x48]")
    grey = np.full(scene.views.shape, 128, np.uint8) + np.arange(n, dtype=np.uint8)[:, None, None, None]
    found = list(check(evolve(scene, views=grey, truth={}, visible={}, regions={})))
    assert {finding.topic: finding.verdict for finding in found} == {
        "order": "unknown",
        "shift": "unknown",
        "rows": "unknown",
        "truth": "note",
    }
    assert not conclusion(found)[1]


@pytest.mark.parametrize(
    ("verdicts", "said", "is_shown"),
    [
        ({"order": "good", "shift": "good", "truth": "note"}, "no problems", True),
        ({"order": "problem", "shift": "unknown"}, "1 problem", False),
        ({"order": "problem", "truth of 2": "problem"}, "2 problems", False),
        ({"order": "unknown", "shift": "good", "truth": "note"}, "not confirmed: order could not be", False),
        ({"order": "unknown", "rows": "unknown", "truth of 2": "good"}, "no problems, but unknown: order, rows", True),
    ],
)
def test_unknown_is_not_summed_up_as_good(verdicts: dict[str, Verdict], said: str, is_shown: bool) -> None:
    told, shown = conclusion([Observation(topic, verdict, "") for topic, verdict in verdicts.items()])
    assert told.startswith(said)
    assert shown is is_shown


def test_a_single_pixel_beyond_the_range_is_told(scene: Scene) -> None:
    truth = scene.truth[scene.ref].copy()
    truth[50, 60] = scene.disparities.largest + 0.25
    found = [finding for finding in check(evolve(scene, truth={scene.ref: truth})) if finding.verdict != "good"]
    assert [(finding.topic, finding.verdict) for finding in found] == [(f"truth of {scene.ref}", "note")]
    assert f"1 of {truth.size} pixels" in found[0].text


@pytest.mark.parametrize(("down", "turn"), [(2.0, 0.0), (-1.5, 0.0), (0.0, 1.0)])
def test_views_that_are_not_rectified_are_told(scene: Scene, down: float, turn: float) -> None:
    views = scene.views.copy()
    views[4] = _shifted(views[4], down, turn)
    finding = _found(evolve(scene, views=views, truth={}, visible={}, regions={}))["rows"]
    assert finding.verdict == "problem"
    assert "view 4" in finding.text
    assert ("turned" in finding.text) == (turn != 0)
    measured = rows(match(views, scene.ref)[4])
    assert measured is not None
    if not turn:
        assert measured.offset == pytest.approx(down, abs=0.15)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda truth: -truth, "sign reversed"),
        (lambda truth: truth[::-1], "upside down"),
        (lambda truth: truth / 2, "twice"),
        (lambda truth: truth * 2, "half"),
        (lambda truth: truth * 3, "divided by 3"),
        (lambda truth: truth + 0.4, "smaller disparities"),
        (lambda truth: truth - 0.4, "larger disparities"),
        (lambda truth: np.random.default_rng(0).permuted(truth), "one disparity"),
    ],
)
def test_truth_that_is_not_that_of_the_images_is_told(
    scene: Scene, change: Callable[[np.ndarray], np.ndarray], words: str
) -> None:
    assert scene.pair_steps == 2
    pair = 3.0 if "divided by 3" in words else scene.pair_steps
    truth = np.ascontiguousarray(change(scene.truth[scene.ref]), np.float32)
    wrong = evolve(scene, truth={scene.ref: truth}, visible={}, regions={}, disparities=Range(-60, 60), pair_steps=pair)
    _only_problem(wrong, f"truth of {scene.labels[scene.ref]}", words)


def test_truth_that_leads_out_of_the_frame_is_told(scene: Scene) -> None:
    truth = np.full_like(scene.truth[scene.ref], 300)
    wrong = evolve(scene, truth={scene.ref: truth}, visible={}, regions={}, disparities=Range(0, 310))
    _only_problem(wrong, f"truth of {scene.ref}", "leads out")


def test_black_borders_are_noted(scene: Scene) -> None:
    views = scene.views.copy()
    views[0, :, :20] = 0
    finding = _found(evolve(scene, views=views, truth={}, visible={}, regions={}))["borders"]
    assert finding.verdict == "note"
    assert "0 (20)" in finding.text


def test_views_without_features_say_so() -> None:
    blank = np.full((3, 60, 80, 3), 128, np.uint8)
    scene = Scene("blank", blank, ("0", "1", "2"), 1, Range(0, 8), {}, 1)
    found = _found(scene)
    assert [found[topic].verdict for topic in ("order", "shift", "rows")] == ["unknown"] * 3
    assert found["truth"].verdict == "note"


def test_a_repeated_pattern_does_not_mislead() -> None:
    """The floor of the box repeats; some of its features match a period too far."""
    scene = load_scene("synthetic/box")
    found = places(match(scene.views, 2), 5, 2)
    assert found is not None
    np.testing.assert_allclose(found, [-2, -1, 0, 1, 2], atol=0.05)
