"""The probe of recordings and figures: it keeps a bounded part of what a method tells while it works."""

from collections.abc import Mapping, Sequence

import numpy as np
from attrs import define, evolve, field, frozen
from numpy.typing import NDArray

from matbench.algorithm import Probe
from matbench.plans.record_option import RecordOption
from matbench.recording import reduction
from matbench.recording.reduction import ReducedVolume
from matbench.safe_text import printable
from matbench.space import Volume, visibility

TOLD_VOLUMES = 12  # volumes kept by name; further names are dropped, as a method may tell one for every pair
PASS_PIXELS = 200_000  # the map of a pass


@frozen(eq=False)
class PassCapture:
    """What is kept of one pass.

    Parameters
    ----------
    materiality
        (rows, planes, columns) uint8: slices of the wanted rows.
    derivative
        (rows, planes, columns) int8: the sign of dE/dmu in the same slices.
    disparity
        The reference view's map, thinned.
    """

    step: int
    materiality: NDArray[np.uint8] | None
    derivative: NDArray[np.int8] | None
    disparity: NDArray[np.float32] | None


@frozen(eq=False)
class ColoredSlices:
    """Up to three kinds of slice in one picture, as red, green and blue.

    Parameters
    ----------
    picture
        (rows, planes, columns, 3) uint8; unused channels are 0.
    names
        What red, green and blue stand for.
    """

    picture: NDArray[np.uint8]
    names: tuple[str, ...]


@define(eq=False)
class CapturingProbe(Probe):
    """Keeps a bounded part of what a method tells. It copies arrays, as methods may reuse them.

    Energies are kept of every pass. Slices and maps are kept of at most ``wanted.passes`` passes, spread
    evenly, the first and the last among them. Nobody knows beforehand how many passes there will be: so
    whenever there are too many, every second one is dropped, and from then on half as many are kept.

    Parameters
    ----------
    wanted
        What to keep, with the rows of the slices.
    volumes
        Name -> volume, reduced.
    similarities
        Name -> (rows, planes, columns) uint8, slices of a pair's similarity.
    latest
        The slices of the similarity that was told last.
    energies
        Name -> (pass, value), in order.
    """

    wanted: RecordOption
    active: bool = True
    volumes: dict[str, ReducedVolume] = field(factory=dict)
    similarities: dict[str, NDArray[np.uint8]] = field(factory=dict)
    latest: Volume | None = None
    energies: dict[str, list[tuple[int, float]]] = field(factory=dict)
    _frames: list[PassCapture] = field(factory=list)
    _last: PassCapture | None = None
    _told: int = 0
    _stride: int = 1

    def volume(self, name: str, volume: Volume) -> None:
        name = printable(name)
        if self.wanted.slices and name.startswith("similarity/"):
            self.latest = self.slices_of(volume)
            self.similarities[name] = reduction.as_bytes(self.latest.values)
        if self.wanted.volumes and (name in self.volumes or len(self.volumes) < TOLD_VOLUMES):
            self.volumes[name] = reduction.reduce_volume(volume, min(self.wanted.rows[0], volume.space.rows - 1))

    def iteration(
        self,
        step: int,
        energies: Mapping[str, float],
        volume: Volume | None = None,
        derivative: Volume | None = None,
        disparity: NDArray[np.float32] | None = None,
    ) -> None:
        for name, value in energies.items():
            self.energies.setdefault(printable(name), []).append((step, float(value)))
        if (volume is None and derivative is None and disparity is None) or not self.wanted.passes:
            return
        if not self.wanted.slices:
            volume = derivative = None
        self._last = PassCapture(
            step,
            None if volume is None else reduction.as_bytes(self.slices_of(volume).values),
            None if derivative is None else np.sign(np.nan_to_num(self.slices_of(derivative).values)).astype(np.int8),
            None if disparity is None else np.array(reduction.thinned(disparity, PASS_PIXELS), np.float32),
        )
        if self._told % self._stride == 0:
            self._frames.append(self._last)
            if len(self._frames) > self.wanted.passes:
                self._frames = self._frames[::2]
                self._stride *= 2
        self._told += 1

    @property
    def frames(self) -> list[PassCapture]:
        """The kept passes, at most as many as wanted, with the first and the last that was told."""
        if self._last is None or self._last.step == self._frames[-1].step:
            return list(self._frames)
        return [*self._frames[: self.wanted.passes - 1], self._last]

    def slices_of(self, volume: Volume) -> Volume:
        """The wanted rows of a volume, as a volume that has only these."""
        rows = [min(row, volume.space.rows - 1) for row in self.wanted.rows]
        return Volume(evolve(volume.space, rows=len(rows)), volume.values[rows], volume.views)

    def similarity(self, labels: Sequence[str]) -> ColoredSlices | None:
        """The similarities of three pairs as red, green and blue; None if the method told none.

        Of neighbouring views, if there are at least three such pairs: the first, the middle and the last. Else
        the three pairs whose views are least apart.
        """
        if not self.similarities:
            return None
        names = sorted(self.similarities, key=_apart)
        shape = self.similarities[names[0]].shape
        comparable = [name for name in names if self.similarities[name].shape == shape]
        near = [name for name in comparable if _apart(name) == _apart(names[0])]
        pool = near if len(near) >= 3 else comparable[:3]
        in_order = [name for name in self.similarities if name in pool]
        chosen = [in_order[i] for i in sorted({0, len(pool) // 2, len(pool) - 1})]
        return _colored([self.similarities[name] for name in chosen], [pair_label(name, labels) for name in chosen])

    def visibility(self, volume: Volume, labels: Sequence[str]) -> ColoredSlices:
        """The visibility in the leftmost, the middle and the rightmost view of a volume, as red, green and blue."""
        here, last = self.slices_of(volume), len(volume.views) - 1
        chosen = sorted({0, (last + 1) // 2, last})
        seen = [reduction.as_bytes(visibility(here, view)) for view in chosen]
        return _colored(seen, [labels[volume.views[view]] for view in chosen])


def _colored(channels: Sequence[NDArray[np.uint8]], names: Sequence[str]) -> ColoredSlices:
    picture = np.zeros((*channels[0].shape, 3), np.uint8)
    for channel, values in enumerate(channels):
        picture[..., channel] = values
    return ColoredSlices(picture, tuple(names))


def pair_of(name: str) -> tuple[int, int] | None:
    """The views of a pair: (2, 3) for ``similarity/2-3``; None for other names."""
    first, _, second = name.removeprefix("similarity/").partition("-")
    return (int(first), int(second)) if first.isdecimal() and second.isdecimal() else None


def pair_label(name: str, labels: Sequence[str]) -> str:
    """A pair by its views' labels: ``im2-im3`` for ``similarity/2-3``; other names as they are."""
    pair = pair_of(name)
    if pair is None or max(pair) >= len(labels):
        return name.removeprefix("similarity/")
    return "-".join(labels[view] for view in pair)


def _apart(name: str) -> int:
    """How many view steps the views of a pair are apart; 0 for other names."""
    pair = pair_of(name)
    return abs(pair[1] - pair[0]) if pair else 0
