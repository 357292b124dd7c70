"""The files in a cell's folder: facts, maps, confidence, volume and log. They are read as anybody's files."""

import json
from collections.abc import Mapping
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from attrs import evolve, frozen
from cattrs.preconf.json import make_converter
from numpy.typing import NDArray

from matbench.files.arrays import opened_arrays, write_arrays
from matbench.measures.volumes import StoredVolume
from matbench.plans.plan import Cell
from matbench.runs import provenance
from matbench.runs.outcome import Outcome
from matbench.scene import Scene

MOST_FACTS = 1 << 24  # bytes of a cell's facts: histories of long runs take some
CONFIDENCE = "confidence.npz"
_MOST_MAPS, _MAP_BYTES = 1000, 1 << 32  # of a cell; bytes of all, unpacked

_json = make_converter(detailed_validation=False)


@frozen(eq=False)
class Solved:
    """A stored cell. Its facts and its maps are read together, so they belong to the same solve.

    Parameters
    ----------
    outcome
        None if it has not been computed, or its files are damaged.
    place
        Its folder.
    maps
        View index -> (H, W) disparity map, pixels per view step; empty unless it is ok.
    scene
        What was solved, if the reader knew it.
    """

    cell: Cell
    outcome: Outcome | None
    place: Path
    maps: Mapping[int, NDArray[np.float32]] = {}
    scene: Scene | None = None

    @cached_property
    def volume(self) -> StoredVolume | None:
        """The stored volume, read only when it is asked for: it is large. None if there is none, or it is damaged."""
        return read_volume(self.place, self.scene) if self.outcome is not None and self.outcome.has_volume else None

    @cached_property
    def confidence(self) -> Mapping[int, NDArray[np.float32]]:
        """View index -> (H, W) confidence in [0, 1], NaN where unknown; empty if there is none, or it is damaged."""
        if self.outcome is None or not self.outcome.confidence:
            return {}
        try:
            size = None if self.scene is None else (self.scene.height, self.scene.width)
            found = read_confidence(self.place / CONFIDENCE, size)
        except (ValueError, OSError):
            return {}
        return found if maps_digest(found) == self.outcome.confidence else {}


def maps_digest(maps: Mapping[int, NDArray[np.float32]]) -> str:
    """Sixteen hexadecimal digits of SHA-256 over maps: views, sizes and every bit of the values."""
    digest = sha256()
    for view, values in sorted(maps.items()):
        digest.update(f"{view} {values.shape};".encode() + np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()[:16]


def read_maps(
    path: Path, size: tuple[int, int] | None = None, *, follow: bool = True
) -> dict[int, NDArray[np.float32]]:
    """View index -> (H, W) disparity map in a file, pixels per view step. None is unpacked unless all can be right.

    Parameters
    ----------
    size
        (height, width) that they must have, if that is known.

    Raises
    ------
    ValueError, OSError
        If the file is missing or holds something else.
    """
    with opened_arrays(path, follow=follow) as arrays:
        sizes = {claim.shape for claim in arrays.claims.values()}
        are_maps = all(len(c.shape) == 2 and c.dtype == np.float32 for c in arrays.claims.values())
        if not (are_maps and len(sizes) == 1 and len(arrays.claims) <= _MOST_MAPS):
            raise ValueError(f"{path} holds no disparity maps of one size")
        if size is not None and sizes != {size}:
            raise ValueError(f"the map of {min(arrays.claims)} in {path.name} is {sizes.pop()}, not {size}")
        if arrays.bytes > _MAP_BYTES:
            raise ValueError(f"{path} unpacks to more than {_MAP_BYTES} bytes")
        arrays.check_ratio()
        return {int(name.removeprefix("view_")): arrays.read(name) for name in arrays.claims}


def read_confidence(
    path: Path, size: tuple[int, int] | None = None, *, follow: bool = True
) -> dict[int, NDArray[np.float32]]:
    """View index -> (H, W) confidence map in a file, in [0, 1] or NaN.

    Raises
    ------
    ValueError, OSError
        If the file is missing or holds something else, as `read_maps`.
    """
    found = read_maps(path, size, follow=follow)
    for view, values in found.items():
        check_confidence(view, values)
    return found


def check_confidence(view: int, values: NDArray[np.floating]) -> None:
    """Raise ValueError if a view's confidences are not all in [0, 1] or NaN."""
    known = values[~np.isnan(values)]
    if known.size and not 0 <= known.min() <= known.max() <= 1:
        least, most = (f"{value:.6g}" for value in (known.min(), known.max()))
        raise ValueError(f"the confidence of view {view} runs from {least} to {most}, not within 0 to 1")


def read_volume(place: Path, scene: Scene | None) -> StoredVolume | None:
    """The stored volume in a cell's folder; None if there is none, it is damaged, or it is none of `scene`."""
    try:
        return StoredVolume.read(place / "volume.npz", scene)
    except (ValueError, OSError):
        return None


def write_cell(
    draft: Path,
    cell: Cell,
    outcome: Outcome,
    disparity: Mapping[int, NDArray[np.float32]] | None = None,
    volume: StoredVolume | None = None,
    log: bytes = b"",
) -> None:
    """Fill a cell's draft folder with its facts, its log and, if it has them, its maps and its volume."""
    if volume is not None:
        volume.write(draft / "volume.npz")
    if disparity is not None:
        arrays: dict[str, Any] = {f"view_{view}": values for view, values in disparity.items()}
        write_arrays(draft / "disparity.npz", arrays)
    maps = maps_digest(disparity) if disparity else outcome.maps
    outcome = evolve(outcome, maps=maps, ran_on={**provenance.ran_on(), **outcome.ran_on})
    facts = {"cell": _json.unstructure(cell), "outcome": _json.unstructure(outcome)}
    text = json.dumps(facts, indent=1, allow_nan=False)
    for name, content in (("cell.json", text.encode()), ("log.txt", log)):
        with (draft / name).open("xb") as file:  # a new file: a link or a pipe that lies there is not opened
            file.write(content)
