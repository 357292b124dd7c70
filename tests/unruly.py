"""Methods that each break one promise of the contract, as a user's plug-in file."""

import ctypes
import os
import subprocess
import time

import numpy as np

from matbench import Context, DisparitySpace, Estimate, Scene, Volume


def _flat(scene: Scene, value: float | None = None) -> np.ndarray:
    middle = (scene.disparities.least + scene.disparities.largest) / 2
    return np.full((scene.height, scene.width), middle if value is None else value, np.float32)


class Pries:
    """Opens the lock of its input and changes it."""

    def solve(self, scene: Scene, context: Context) -> Estimate:
        scene.views.setflags(write=True)
        scene.views[..., 0] ^= 1
        return Estimate({scene.ref: _flat(scene)})


class Forgetful:
    """Ignores the seed."""

    def solve(self, scene: Scene, context: Context) -> Estimate:
        found = _flat(scene)
        found[0, 0] += int.from_bytes(os.urandom(4)) / 2**33
        return Estimate({scene.ref: found})


class Crowded:
    """Answers by the number of threads."""

    def solve(self, scene: Scene, context: Context) -> Estimate:
        return Estimate({scene.ref: _flat(scene) + np.float32(context.threads - 1)})


class Infinite:
    """Has infinities where it should have NaN."""

    def solve(self, scene: Scene, context: Context) -> Estimate:
        found = _flat(scene)
        found[::7] = np.inf
        return Estimate({scene.ref: found})


class Leaning:
    """Prefers the left of the image."""

    def solve(self, scene: Scene, context: Context) -> Estimate:
        far, near = scene.disparities.least, scene.disparities.largest
        return Estimate({scene.ref: np.linspace(far, near, scene.width, dtype=np.float32) + 0 * _flat(scene)})


class OfThePair:
    """Mistakes pixels of the pair for pixels per view step."""

    def solve(self, scene: Scene, context: Context) -> Estimate:
        return Estimate({scene.ref: _flat(scene, scene.disparities.largest * scene.pair_steps)})


class Positive:
    """Knows no negative disparities."""

    def solve(self, scene: Scene, context: Context) -> Estimate:
        if scene.disparities.least < 0:
            raise NotImplementedError("disparities below 0")
        return Estimate({scene.ref: _flat(scene)})


class Roomy:
    """Needs a window of pixels, and ends its process where there is none."""

    def solve(self, scene: Scene, context: Context) -> Estimate:
        if min(scene.height, scene.width) < 3:
            ctypes.string_at(0)
        return Estimate({scene.ref: _flat(scene)})


class Twosome:
    """Supports pairs only, and says so."""

    def unsupported_reason(self, scene: Scene) -> str | None:
        return "two views only" if scene.n > 2 else None

    def solve(self, scene: Scene, context: Context) -> Estimate:
        return Estimate({scene.ref: _flat(scene)})


class Solid:
    """Keeps a volume that is no volume of materialities."""

    def solve(self, scene: Scene, context: Context) -> Estimate:
        space = DisparitySpace.covering(scene.disparities, scene.n, scene.height, scene.width)
        return Estimate(
            {scene.ref: _flat(scene)}, Volume(space, np.full(space.shape, 2, np.float32), tuple(range(scene.n)))
        )


class Breeder:
    """Hangs, and has started what would outlive it."""

    def solve(self, scene: Scene, context: Context) -> Estimate:
        subprocess.Popen(["sleep", "3598.75"], start_new_session=True)
        time.sleep(3600)
        raise AssertionError("it waits longer than anybody")


class Chatty:
    """Prints, which is allowed."""

    def solve(self, scene: Scene, context: Context) -> Estimate:
        print("thinking\nhard")
        return Estimate({scene.ref: _flat(scene)})
