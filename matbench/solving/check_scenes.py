"""The small scenes on which `matbench check` tries a method."""

from collections.abc import Mapping
from functools import cache

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from matbench.scene import Range, Scene
from matbench.scenes.catalogue import load_scene
from matbench.scenes.views_only import without_truth

EASY, EITHER_SIGN = "synthetic/box[n=5 ref=1]", "synthetic/curved[n=5 ref=1]"
"""Textured scenes of 240x180 px.

The reference view is not the middle one on purpose. With the middle view, the field's pair could lie on
either side. A method must then break a tie, and in the mirrored scene it would break it the other way,
which is no fault.
"""


@frozen(eq=False)
class Trial:
    """One solve: a scene and the number of threads. The scene is kept as its parts, which can be pickled.

    Parameters
    ----------
    garbage
        The byte that fresh memory is filled with.
    """

    name: str
    views: NDArray[np.uint8]
    ref: int
    disparities: Range
    pair_steps: float
    threads: int = 1
    garbage: int = 0x41

    @classmethod
    def of(cls, name: str, scene: Scene, threads: int = 1) -> "Trial":
        """A trial of a scene; its truth is left out, a method must not see it."""
        return cls(name, scene.views, scene.ref, scene.disparities, scene.pair_steps, threads)

    @property
    def scene(self) -> Scene:
        """The scene, without truth."""
        labels = tuple(str(view) for view in range(len(self.views)))
        return Scene(self.name, self.views, labels, self.ref, self.disparities, {}, self.pair_steps)


def mirrored(scene: Scene) -> Scene:
    """The mirrored scene: columns and the order of the views are reversed.

    With x' = W - 1 - x and j' = n - 1 - j, x_j = x_ref - (j - ref) d becomes
    x'_j' = x'_ref' - (j' - ref') d: disparities keep their sign, maps are reversed along their rows.
    """
    last = scene.n - 1
    return evolve(
        scene,
        views=scene.views[::-1, :, ::-1],
        labels=scene.labels[::-1],
        positions=tuple(scene.places[-1] - position for position in scene.places[::-1]),
        ref=last - scene.ref,
        truth={last - view: truth[:, ::-1] for view, truth in scene.truth.items()},
        regions={name: mask[:, ::-1] for name, mask in scene.regions.items()},
        visible={last - view: seen[::-1, :, ::-1] for view, seen in scene.visible.items()},
        held_out=scene.held_out
        and evolve(scene.held_out, image=scene.held_out.image[:, ::-1], steps=-scene.held_out.steps),
    )


def _small(shape: tuple[int, int], disparities: Range, value: int | None = None) -> Scene:
    """Three views without truth: random colours, or one grey value everywhere."""
    size = (3, *shape, 3)
    pixels = np.random.default_rng(1).integers(0, 256, size) if value is None else np.full(size, value)
    return Scene("small", pixels.astype(np.uint8), ("0", "1", "2"), 1, disparities, {}, 1)


@cache
def truths() -> Mapping[str, Scene]:
    """The trials whose ground truth is known to whoever judges, by name."""
    return {name: load_scene(scene) for name, scene in (("easy", EASY), ("either sign", EITHER_SIGN))}


@cache
def trials() -> Mapping[str, Trial]:
    """All trials, by name."""
    easy, either = map(without_truth, truths().values())
    scenes = {
        "easy": easy,
        "easy again": easy,
        "easy mirrored": mirrored(easy),
        "either sign": either,
        "either sign mirrored": mirrored(either),
        "two views": easy.choose((1, 3)),
        "three views": easy.choose((0, 1, 2)),
        "1x1 px": _small((1, 1), Range(0, 5)),
        "one row": _small((1, 40), Range(-2, 5)),
        "one column": _small((30, 1), Range(0, 5)),
        "narrower than the range": _small((12, 5), Range(0, 12)),
        "constant": _small((24, 48), Range(0, 8), value=128),
    }
    found = {name: Trial.of(name, scene) for name, scene in scenes.items()}
    # as float32 the first garbage is 12.08 and the other -24.22: neither looks like "no answer"
    other = evolve(found["easy"], garbage=0xC1)
    return {**found, "easy, 3 threads": Trial.of("easy", easy, threads=3), "easy, other garbage": other}
