"""The probe that listens: a bounded part of what a method tells, kept for a recording."""

from collections.abc import Mapping

import numpy as np
from attrs import define, field, frozen
from numpy.typing import NDArray

from matbench import drawing
from matbench.algorithm import Probe
from matbench.drawing import Reduced
from matbench.space import Volume

FRAMES = 20  # passes whose slices and maps are kept
TOLD_VOLUMES = 12  # volumes that a method tells; later names are left out
PASS_PIXELS = 200_000  # the map of a pass


@frozen(eq=False)
class Frame:
    """What is kept of one pass: the slice of materiality, the derivative's sign, and the map."""

    step: int
    materiality: NDArray[np.uint8] | None
    derivative: NDArray[np.int8] | None
    disparity: NDArray[np.float32] | None


@define(eq=False)
class RecordingProbe(Probe):
    """Keeps a bounded part of what a method tells, copied: methods may reuse their arrays.

    Energies are kept of every pass. Slices and maps are kept of at most `FRAMES` passes spread
    evenly, the first and the last among them: whenever there are too many, every other one goes.

    Parameters
    ----------
    row
        The image row that slices show.
    """

    row: int
    active: bool = True
    volumes: dict[str, Reduced] = field(factory=dict)
    similarities: dict[str, NDArray[np.uint8]] = field(factory=dict)
    energies: dict[str, list[tuple[int, float]]] = field(factory=dict)
    _frames: list[Frame] = field(factory=list)
    _last: Frame | None = None
    _told: int = 0
    _stride: int = 1

    def volume(self, name: str, volume: Volume) -> None:
        row = self.slice_of(volume)
        if name in self.volumes or len(self.volumes) < TOLD_VOLUMES:
            self.volumes[name] = drawing.reduced(volume, min(self.row, volume.space.rows - 1))
        if name.startswith("similarity/"):
            self.similarities[name] = drawing.as_bytes(row)

    def iteration(
        self,
        step: int,
        energies: Mapping[str, float],
        volume: Volume | None = None,
        derivative: Volume | None = None,
        disparity: NDArray[np.float32] | None = None,
    ) -> None:
        for name, value in energies.items():
            self.energies.setdefault(name, []).append((step, float(value)))
        if volume is None and derivative is None and disparity is None:
            return
        self._last = Frame(
            step,
            None if volume is None else drawing.as_bytes(self.slice_of(volume)),
            None if derivative is None else np.sign(np.nan_to_num(self.slice_of(derivative))).astype(np.int8),
            None if disparity is None else np.array(drawing.thinned(disparity, PASS_PIXELS), np.float32),
        )
        if self._told % self._stride == 0:
            self._frames.append(self._last)
            if len(self._frames) > FRAMES:
                self._frames = self._frames[::2]
                self._stride *= 2
        self._told += 1

    @property
    def frames(self) -> list[Frame]:
        """At most `FRAMES` passes, the first and the last one told among them."""
        if self._last is None or self._last is self._frames[-1]:
            return list(self._frames)
        return [*self._frames[: FRAMES - 1], self._last]

    def slice_of(self, volume: Volume) -> NDArray[np.float32]:
        """(planes, columns): the epipolar plane that is shown."""
        plane: NDArray[np.float32] = volume.values[min(self.row, volume.space.rows - 1)]
        return plane

    def similarity(self) -> NDArray[np.uint8] | None:
        """(planes, columns, 3): three pairs as red, green and blue.

        Pairs of neighbouring views, if there are three: of more the first, the middle and the last.
        Else the three whose views are least apart. Channels without a pair are 0.
        """
        if not self.similarities:
            return None
        names = sorted(self.similarities, key=_apart)
        shape = self.similarities[names[0]].shape
        alike = [name for name in names if self.similarities[name].shape == shape]
        near = [name for name in alike if _apart(name) == _apart(names[0])]
        pool = near if len(near) >= 3 else alike[:3]
        in_order = [self.similarities[name] for name in self.similarities if name in pool]
        chosen = [in_order[i] for i in sorted({0, len(pool) // 2, len(pool) - 1})]
        picture = np.zeros((*shape, 3), np.uint8)
        for channel, values in enumerate(chosen):
            picture[:, :, channel] = values
        return picture


def pair_of(name: str) -> tuple[int, int] | None:
    """The views of a pair: (2, 3) for ``similarity/2-3``; None if the name does not say."""
    first, _, second = name.removeprefix("similarity/").partition("-")
    return (int(first), int(second)) if first.isdigit() and second.isdigit() else None


def _apart(name: str) -> int:
    pair = pair_of(name)
    return abs(pair[1] - pair[0]) if pair else 0
