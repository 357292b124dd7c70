"""What the process that solves makes of an estimate, and of what a method raises."""

from multiprocessing import Pipe
from subprocess import CalledProcessError

import numpy as np
import pytest

from matbench.algorithm import Estimate
from matbench.scene import Range, Scene
from matbench.solving import worker

SCENE = Scene("toy", np.full((3, 4, 6, 3), 7, np.uint8), ("a", "b", "c"), 1, Range(0, 2), {}, 2.0)
MAP = np.ones((4, 6))


def test_maps_become_float32_and_what_is_no_number_no_answer() -> None:
    odd = np.ma.masked_array(MAP * [0, np.inf, -np.inf, np.nan, 1e300, 3], mask=np.eye(4, 6, 5, bool))
    found = worker.checked(Estimate({np.int64(1): odd, 0: MAP.astype(int)}), SCENE)
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
    ],
)
def test_what_is_no_estimate_is_told(estimate: object, said: str) -> None:
    with pytest.raises((TypeError, ValueError), match=said):
        worker.checked(estimate, SCENE)


def test_methods_are_compiled_on_noise_of_the_same_kind() -> None:
    found = worker.like(SCENE, (2, 5))
    assert found.views.shape == (3, 2, 5, 3)
    assert (found.name, found.labels, found.ref, found.disparities) == (SCENE.name, SCENE.labels, 1, SCENE.disparities)
    assert len(np.unique(found.views)) > 10, "nothing of the scene is in it"


@pytest.mark.parametrize(
    ("error", "status"),
    [
        (KeyboardInterrupt(), "interrupted"),
        (MemoryError("Unable to allocate 1 TiB"), "out-of-memory"),
        (RuntimeError("OpenCV: Insufficient memory (Failed to allocate 99 bytes)"), "out-of-memory"),
        (OSError(12, "Cannot allocate memory"), "out-of-memory"),
        (SystemExit(0), "failed"),
        (CalledProcessError(1, ["false"]), "failed"),
        (ValueError("memory of a better time"), "failed"),
    ],
)
def test_the_status_follows_from_what_was_raised(error: BaseException, status: str) -> None:
    found, reason = worker._what_failed(error)
    assert found == status
    assert type(error).__name__ in reason


def test_a_method_is_timed_only_when_the_keeper_has_counted() -> None:
    ours, theirs = Pipe()
    theirs.send_bytes(b"counted")
    worker.KeeperLine(ours).say_and_wait("begins")
    assert theirs.poll()
    assert not ours.poll(), "it has heard that"
