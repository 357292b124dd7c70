"""What a method is given, and what it may say."""

import numpy as np
import pytest

from matbench.algorithm import Algorithm, Context, Estimate, Probe, unsupported
from matbench.scene import Range, Scene


class Solves:
    def solve(self, scene: Scene, context: Context) -> Estimate:
        return Estimate({scene.ref: np.zeros((scene.height, scene.width), np.float32)})


class Declines(Solves):
    def __init__(self, reason: object) -> None:
        self.reason = reason

    def unsupported_reason(self, scene: Scene) -> object:
        return self.reason


@pytest.fixture
def scene() -> Scene:
    return Scene("toy", np.zeros((2, 3, 4, 3), np.uint8), ("0", "1"), 0, Range(0, 2), {}, 1.0)


def test_whoever_solves_is_a_method() -> None:
    assert isinstance(Solves(), Algorithm)
    assert not isinstance(Probe(), Algorithm)


@pytest.mark.parametrize(("reason", "said"), [("two views only", "two views only"), (None, ""), ("", ""), (False, "")])
def test_a_method_may_decline_a_scene(scene: Scene, reason: object, said: str) -> None:
    assert unsupported(Declines(reason), scene) == said  # type: ignore[arg-type]
    assert unsupported(Solves(), scene) == ""


def test_without_more_nobody_listens_and_the_volume_is_wanted(scene: Scene) -> None:
    context = Context()
    assert (context.seed, context.threads, context.volume, context.probe.active) == (0, 1, True, False)
    context.probe.iteration(0, {"total": 1.0})
    context.probe.volume("similarity/0-1", None)  # type: ignore[arg-type]
    assert Solves().solve(scene, context).history == {}
    assert Context().probe is not context.probe, "none is shared"


def test_a_method_that_does_not_say_so_gets_no_views_at_uneven_steps(scene: Scene) -> None:
    views = np.zeros((3, 3, 4, 3), np.uint8)
    uneven = Scene("toy", views, ("a0", "a1", "a2"), 2, Range(0, 2), {}, 1.0, positions=(0, 1, 2.5))
    said = "it takes views at even steps, and these lie at 0, 1, 2.5: views=a1+a2 chooses two of them"
    assert unsupported(Solves(), uneven) == said
    takes = Declines(None)
    takes.uneven = True  # type: ignore[attr-defined]
    assert unsupported(takes, uneven) == ""
    assert unsupported(Solves(), uneven.choose([1, 2])) == ""
