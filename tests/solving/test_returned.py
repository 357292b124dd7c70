"""What becomes of an estimate: types, shapes, ranges, and what is refused in one line."""

import numpy as np
import pytest

from matbench.algorithm import Estimate
from matbench.scene import Range, Scene
from matbench.solving.returned import checked_confidence, checked_maps, device_cost

SCENE = Scene("toy", np.full((3, 4, 6, 3), 7, np.uint8), ("a", "b", "c"), 1, Range(0, 2), {}, 2.0)
MAP = np.ones((4, 6))


def test_maps_become_float32_and_what_is_no_number_no_answer() -> None:
    odd = np.ma.masked_array(MAP * [0, np.inf, -np.inf, np.nan, 1e300, 3], mask=np.eye(4, 6, 5, bool))
    found = checked_maps(Estimate({np.int64(1): odd, 0: MAP.astype(int)}), SCENE)
    assert {type(view) for view in found} == {int}
    assert {values.dtype.name for values in found.values()} == {"float32"}
    nan = np.nan
    np.testing.assert_array_equal(found[1], [[0, nan, nan, nan, nan, nan], *[[0, nan, nan, nan, nan, 3]] * 3])
    np.testing.assert_array_equal(found[0], MAP)


@pytest.mark.parametrize(
    ("estimate", "said"),
    [
        (MAP, "solve returned ndarray, not an Estimate"),
        (None, "solve returned NoneType"),
        (Estimate({0: MAP}), "no disparity map of the reference view 1"),
        (Estimate({1: MAP, 3: MAP}), "a map of view 3, the scene has the views 0 to 2"),
        (Estimate({1: MAP, -1: MAP}), "a map of view -1"),
        (Estimate({1: MAP, "b": MAP}), "a map of view 'b'"),  # type: ignore[dict-item]
        (Estimate({1: MAP[:3]}), r"view 1 is \(3, 6\) float64, not \(4, 6\) numbers"),
        (Estimate({1: MAP.astype(complex)}), "complex128"),
        (Estimate({1: MAP > 0}), "bool"),
        (Estimate({1: [[1, 2], [3]]}), r"the map of view 1 is no array of \(4, 6\) numbers"),  # type: ignore[dict-item]
    ],
)
def test_what_is_no_estimate_is_told(estimate: object, said: str) -> None:
    with pytest.raises((TypeError, ValueError), match=said):
        checked_maps(estimate, SCENE)


def test_confidences_become_float32_and_what_is_masked_unknown() -> None:
    odd = np.ma.masked_array(MAP * [0, 0.25, 1, np.nan, 0.5, 1], mask=np.eye(4, 6, 5, bool))
    found = checked_confidence(Estimate({1: MAP}, confidence={np.int64(1): odd, 0: MAP.astype(int)}), SCENE)
    assert {type(view) for view in found} == {int}
    assert {values.dtype.name for values in found.values()} == {"float32"}
    nan = np.nan
    np.testing.assert_array_equal(found[1], [[0, 0.25, 1, nan, 0.5, nan], *[[0, 0.25, 1, nan, 0.5, 1]] * 3])
    assert checked_confidence(Estimate({1: MAP}), SCENE) == {}


@pytest.mark.parametrize(
    ("confidence", "said"),
    [
        (MAP, "the confidence is ndarray, not a map for each view"),
        ({0: MAP}, "none of the reference view 1"),
        ({1: MAP, 3: MAP}, "a confidence of view 3, the scene has the views 0 to 2"),
        ({1: [[1, 2], [3]]}, r"the confidence of view 1 is no array of \(4, 6\) numbers"),
        ({1: MAP[:3]}, r"the confidence of view 1 is \(3, 6\) float64, not \(4, 6\) numbers"),
        ({1: MAP > 0}, "bool"),
        ({1: MAP * 1.5}, "runs from 1.5 to 1.5, not within 0 to 1"),
        ({1: MAP - 1.25}, "runs from -0.25 to -0.25"),
        ({1: MAP * np.inf}, "inf"),
    ],
)
def test_what_is_no_confidence_is_told(confidence: object, said: str) -> None:
    with pytest.raises((TypeError, ValueError), match=said):
        checked_confidence(Estimate({1: MAP}, confidence=confidence), SCENE)  # type: ignore[arg-type]


def test_what_a_device_took_is_a_number() -> None:
    told = [None, 2, 0.5, np.float32(0.25), np.int64(3)]
    assert [device_cost(Estimate({}, device_mb=v), "device_mb") for v in told] == [None, 2, 0.5, 0.25, 3]  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("told", "said"),
    [("fast", "device_seconds is str, not a number"), (np.ones(3), "is ndarray"), (True, "is bool"), (-1, "is -1")],
)
def test_what_no_device_takes_is_refused(told: object, said: str) -> None:
    with pytest.raises((TypeError, ValueError), match=said):
        device_cost(Estimate({}, device_seconds=told), "device_seconds")  # type: ignore[arg-type]
