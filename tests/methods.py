"""Methods that behave and misbehave, as a user's plug-in file."""

import os
import time

import numpy as np
from attrs import frozen

from matbench import Context, DisparitySpace, Estimate, Scene, Volume


def _flat(scene: Scene, value: float) -> Estimate:
    return Estimate({scene.ref: np.full((scene.height, scene.width), value, np.float32)})


@frozen
class Flat:
    """One disparity everywhere."""

    value: float = 1.0

    def solve(self, scene: Scene, context: Context) -> Estimate:
        return _flat(scene, self.value)


class Noise:
    """Random disparities from the context's seed."""

    def solve(self, scene: Scene, context: Context) -> Estimate:
        values = np.random.default_rng(context.seed).random((scene.height, scene.width), np.float32)
        return Estimate({scene.ref: values})


class Peeks:
    """Returns the truth, if it is shown any."""

    def solve(self, scene: Scene, context: Context) -> Estimate:
        return Estimate({scene.ref: scene.truth[scene.ref]})


class Writes:
    """Writes into its input."""

    def solve(self, scene: Scene, context: Context) -> Estimate:
        scene.views[:] = 0
        return _flat(scene, 0)


class Exits:
    """Ends its process."""

    def solve(self, scene: Scene, context: Context) -> Estimate:
        os._exit(7)


class Leaves:
    """Asks Python to end."""

    def solve(self, scene: Scene, context: Context) -> Estimate:
        raise SystemExit(0)


class NeedsRoom:
    """Cannot be compiled on a corner of the scene."""

    def __init__(self, share=0.5):  # type: ignore[no-untyped-def]
        self.share = share

    def solve(self, scene: Scene, context: Context) -> Estimate:
        if scene.width < 65:
            raise ValueError("too narrow")
        return _flat(scene, self.share)


class _Help:
    """Not for the public."""

    def solve(self, scene: Scene, context: Context) -> Estimate:
        raise AssertionError("must not be offered")


class Raises:
    """Fails, having said something."""

    def solve(self, scene: Scene, context: Context) -> Estimate:
        print("about to fail")
        raise ArithmeticError("the third digit is missing\nand more")


class Misshapen:
    """Returns a map of the wrong size."""

    def solve(self, scene: Scene, context: Context) -> Estimate:
        return Estimate({scene.ref: np.zeros((3, 3), np.float32)})


class Bare:
    """Returns no estimate."""

    def solve(self, scene: Scene, context: Context) -> Estimate:
        return np.zeros((scene.height, scene.width), np.float32)  # type: ignore[return-value]


class Declines:
    """Supports nothing."""

    def unsupported_reason(self, scene: Scene) -> str:
        return "only scenes with a hundred views"

    def solve(self, scene: Scene, context: Context) -> Estimate:
        raise AssertionError("must not be asked")


class Slow:
    """Takes its time."""

    def solve(self, scene: Scene, context: Context) -> Estimate:
        time.sleep(30 if scene.width > 64 else 0)
        return _flat(scene, 0)


@frozen
class Empty:
    """Answers nowhere."""

    def solve(self, scene: Scene, context: Context) -> Estimate:
        return _flat(scene, np.nan)


@frozen
class Solid:
    """A wall of half materiality, in the middle plane."""

    material: float = 0.5

    def solve(self, scene: Scene, context: Context) -> Estimate:
        space = DisparitySpace.covering(scene.disparities, scene.n, scene.height, scene.width)
        values = np.zeros(space.shape, np.float32)
        values[:, space.planes // 2] = self.material
        flat = _flat(scene, float(space.disparities[space.planes // 2]))
        return Estimate(flat.disparity, volume=Volume(space, values, tuple(range(scene.n))))


class Shy:
    """Fails only while it is recorded."""

    def solve(self, scene: Scene, context: Context) -> Estimate:
        if context.probe.active:
            raise RuntimeError("not before the camera")
        return _flat(scene, 1)
