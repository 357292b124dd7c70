"""A synthetic scene from its name and options."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from matbench import regions as region_masks
from matbench import scene as scenes
from matbench import spec
from matbench.datasets import choose
from matbench.datasets.choose import search_range, views_and_reference
from matbench.datasets.synthetic import asking, random_scenes
from matbench.datasets.synthetic.asking import HEIGHT, OPTIONS, VIEWS, WIDTH, Asked
from matbench.datasets.synthetic.cameras import NOTHING, Strengths, exposed, heights
from matbench.datasets.synthetic.rendering import Rig
from matbench.datasets.synthetic.surfaces import Array
from matbench.datasets.synthetic.textures import pattern
from matbench.datasets.synthetic.worlds import WORLDS
from matbench.errors import unknown
from matbench.regions import regions
from matbench.scene import Range, Scene
from matbench.scenes import kept
from matbench.scenes.dataset import Listing
from matbench.space import DisparitySpace, Volume, surface

_BASELINE = 1 / 40
"""In units of the world. The focal length is the width of a picture: at 240 px the disparity is 6 / Z px per step."""


_HERE = Path(__file__).parent
_SOURCES = (
    *sorted(file for file in _HERE.iterdir() if file.suffix in (".py", ".json")),
    *(Path(str(module.__file__)) for module in (choose, region_masks, scenes, spec)),
)
"""What decides the pixels and the truth of a scene besides its name and options."""


@frozen(eq=False)
class _Painted:
    """A `Rig` and the pattern on its surfaces, as `Asked` needs it."""

    rig: Rig
    marks: NDArray[np.float32]

    def depth(self, view: int, fineness: int = 1) -> Array:
        return self.rig.depth(view, fineness)

    def disparity(self, depth: Array) -> Array:
        return self.rig.disparity(depth)

    def visible(self, view: int, depth: Array) -> NDArray[np.bool_]:
        return self.rig.visible(view, depth)

    def picture(self, view: int, highlight: float) -> NDArray[np.float32]:
        return evolve(self.rig, highlight=highlight).picture(view, self.marks)

    def pictures(self, view: int, highlight: float) -> NDArray[np.float32]:
        dull = self.picture(view, 0.0)
        return np.stack([dull, self.picture(view, highlight) if highlight else dull])


def _named(name: str, options: Mapping[str, str]) -> Asked:
    """One of the ten scenes with a name, as it was asked for."""
    called, world = f"synthetic/{name}", WORLDS[name]
    asking.check_options(called, options, OPTIONS)
    n = asking.number(called, options, "n", VIEWS, 2, 25)
    seed = asking.number(called, options, "seed", 0, 0, 2**31 - 1)
    width, height = asking.size(called, options)
    strengths = asking.strengths(called, options, Strengths(**world.strengths))
    scale = width / WIDTH
    rig = Rig(
        world.build(),
        n,
        width,
        height,
        width,
        _BASELINE,
        world.offset * scale,
        heights(strengths, seed, n),
    )
    return Asked(
        called=called,
        options=options,
        n=n,
        seed=seed,
        width=width,
        height=height,
        strengths=strengths,
        ref=n // 2,
        pair_steps=max(1, n - 1 - n // 2),
        disparities=Range(0 - world.offset, world.largest - world.offset).scaled(scale),
        cameras=_Painted(rig, pattern(seed)),
    )


def _read(name: str, options: Mapping[str, str]) -> Asked:
    if name in WORLDS:
        return _named(name, options)
    found = random_scenes.read(name, options)
    if found is None:
        raise unknown("scene of synthetic", name, (*WORLDS, random_scenes.NAME))
    return found


class Synthetic:
    """The dataset of computed scenes."""

    def listings(self, root: Path | None) -> Sequence[Listing]:  # noqa: ARG002
        """All of them; they need no data root."""
        size = {f"{WIDTH}x{HEIGHT}": (WIDTH, HEIGHT)}
        return [
            *(Listing(name, VIEWS, size, True) for name in WORLDS),
            Listing(random_scenes.NAME, VIEWS, size, True, endless=True),
        ]

    def sets(self) -> Mapping[str, Sequence[str]]:
        """The sets of random worlds."""
        return random_scenes.SETS

    def load(self, name: str, options: Mapping[str, str], root: Path | None) -> Scene:  # noqa: ARG002
        """Compute a scene.

        Options are `n` (number of views), `size` of a picture, `seed` (of textures, cameras and noise; of a random
        world all is drawn by it), `views` and `baseline` (which views to keep), `ref` (the view to score, by number),
        `disparities` to search, and the faults of cameras (`cameras.Strengths`). Regions are found in pictures without
        these faults, so that they stay the same in a sweep. Only misalignment moves them with the picture.

        A scene that was computed before is read, where it is still kept (`matbench.scenes.kept`).
        """
        return kept.scene(kept.key(_SOURCES, name, dict(options)), lambda: self._computed(name, options))

    def _computed(self, name: str, options: Mapping[str, str]) -> Scene:
        ask = _read(name, options)
        labels = [str(view) for view in range(ask.n)]
        from_ref = sorted(range(ask.n), key=lambda view: (abs(view - ask.ref), view))
        chosen, ref = views_and_reference(ask.called, labels, from_ref, options)
        searched = search_range(ask.called, options.get("disparities"), ask.pair_steps)
        cameras, strengths = ask.cameras, ask.strengths

        dull, reference = cameras.pictures(ref, strengths.highlight)

        def look(view: int) -> tuple[NDArray[np.uint8], NDArray[np.float32], NDArray[np.bool_]]:
            sharp = reference if view == ref else cameras.picture(view, strengths.highlight)
            picture = exposed(sharp, strengths, ask.seed, view, ask.n)
            depth = cameras.depth(view)
            return picture, cameras.disparity(depth).astype(np.float32), cameras.visible(view, depth)

        found = {view: look(view) for view in chosen}
        views = np.zeros((ask.n, ask.height, ask.width, 3), np.uint8)
        for view, (picture, _, _) in found.items():
            views[view] = picture
        _, truth, visible = found[ref]
        # regions come from this picture: the reference view without faults of the camera and without highlights
        undisturbed = exposed(dull, NOTHING, ask.seed, ref, ask.n)
        partner = ask.partner(ref)
        full = Scene(
            name=spec.label(ask.called, dict(sorted(ask.options.items()))),
            views=views,
            labels=tuple(labels),
            ref=ref,
            disparities=searched or ask.disparities,
            truth={view: truth for view, (_, truth, _) in found.items()},
            pair_steps=ask.pair_steps,
            regions=regions(undisturbed, truth, partner, visible[ref + partner]),
            visible={view: seen for view, (_, _, seen) in found.items()},
        )
        return full if len(chosen) == ask.n else full.choose(chosen)


def materiality(name: str, options: Mapping[str, str] | None = None, fineness: int = 1) -> Volume:
    """The exact materialities of a synthetic scene: 1 on surfaces that at least one view sees, else 0.

    Parameters
    ----------
    name, options
        As for `Synthetic.load`. All n views are used; `views` and `ref` have no effect.
    fineness
        Planes per pixel of view step, samples per pixel.

    Returns
    -------
    Volume over all n views; see `matbench.space.surface`. A ray is cast for every sample; nothing is
    interpolated.
    """
    ask = _read(name, options or {})
    space = DisparitySpace.covering(ask.disparities, ask.n, ask.height, ask.width, fineness)
    maps = {view: ask.cameras.disparity(ask.cameras.depth(view, fineness)).astype(np.float32) for view in range(ask.n)}
    return surface(space, maps, tuple(range(ask.n)))


SYNTHETIC = Synthetic()
