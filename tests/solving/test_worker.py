"""What the process that solves makes of an estimate, and of what a method raises."""

from multiprocessing import Pipe
from subprocess import CalledProcessError

import numpy as np
import pytest

from matbench.scene import Range, Scene
from matbench.solving import worker

SCENE = Scene("toy", np.full((3, 4, 6, 3), 7, np.uint8), ("a", "b", "c"), 1, Range(0, 2), {}, 2.0)
MAP = np.ones((4, 6))


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
