"""Rewrite the registry of Middlebury scenes and files, ``middlebury.json``, from a manifest.

    python -m matbench.datasets.make_registry MANIFEST.json

A manifest is a list of all scenes and files. It maps ``middlebury/FOLDER/SCENE`` to the scene's ``facts``
and ``files``; a file has ``bytes``, ``sha256`` and ``pixels``, the digest of `images.pixel_digests`. Files
that hold no picture are left out: nothing reads them.

The layouts (how files are named, what grey levels mean, where files can be downloaded) are written by
hand in ``middlebury.json``. They stay as they are; only the scenes are replaced. A manifest that
contradicts the layouts is refused.
"""

import json
import sys
from collections.abc import Mapping
from math import ceil
from pathlib import Path, PurePosixPath
from typing import Any

from matbench.datasets.registry import REGISTRY, YEARS, Layout, registry
from matbench.datasets.stored import ROUND_UP
from matbench.errors import UserError

DIGITS = 4  # of a disparity in a manifest, before it is taken for a whole number of grey levels


def scenes(year: str, manifest: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """One year's scenes as the registry stores them: scene -> size -> facts and files.

    Raises
    ------
    UserError
        If the manifest contradicts the layouts.
    """
    known = registry(year)
    found: dict[str, dict[str, Any]] = {name: {} for name in known.scenes}
    for size, general in known.layouts.items():
        for path, entry in manifest.items():
            place = PurePosixPath(path)
            if place.parent != PurePosixPath("middlebury") / general.folder:
                continue
            layout = known.special.get(place.name, general)
            found.setdefault(place.name, {})[size] = _facts(path, layout, entry)
    for size in known.layouts:
        ranges = [sizes[size]["largest"] for sizes in found.values() if sizes.get(size, {}).get("largest")]
        for sizes in found.values():
            if size in sizes and sizes[size]["largest"] is None:  # no truth: as far as any scene of its set
                sizes[size]["largest"] = max(ranges)
    return {name: {size: sizes[size] for size in known.layouts if size in sizes} for name, sizes in found.items()}


def _facts(path: str, layout: Layout, entry: Mapping[str, Any]) -> dict[str, Any]:
    facts, files = entry["facts"], entry["files"]
    stems = {PurePosixPath(name).stem for name in files}
    truth = [k for k in layout.with_truth if layout.truth.format(k) in stems]
    said = (facts["views"], facts["gt_grey_per_px"], facts["gt_steps"], facts["unknown"], len(facts["gt"]))
    meant = (len(layout.numbers), layout.grey, layout.steps, layout.unknown, len(truth))
    if said != meant:
        raise UserError(f"{path}: views, grey levels, steps, unknown and truths are {said}, in the layout {meant}")
    for number in layout.numbers:
        if layout.view.format(number) not in stems:
            raise UserError(f"{path}: no file of view {number}")
    largest: float | None = layout.largest
    if largest is None and truth:
        # stored as rounded px per view step; the truth itself is a whole number of grey levels
        nearest = max(high for _, high in facts["unit_disparity_px"].values()) * layout.steps
        nearest = round(round(nearest * layout.grey, DIGITS)) / layout.grey
        largest = ceil(nearest / ROUND_UP) * ROUND_UP
    return {
        "size": facts.get("size"),
        "truth": truth,
        "largest": largest,
        "files": {
            name: [file["bytes"], file["sha256"], file["pixels"]]
            for name, file in sorted(files.items())
            if file["pixels"]
        },
    }


def text(everything: Mapping[str, Any]) -> str:
    """The registry as JSON, with one line for each file and each layout: changes are easy to review."""

    def lines(value: Any, depth: int) -> str:
        flat = json.dumps(value)
        if not isinstance(value, dict) or (depth == 3 and "folder" in value):
            return flat
        inside = ",\n".join(
            " " * (depth + 1) + json.dumps(key) + ": " + lines(child, depth + 1) for key, child in value.items()
        )
        return "{\n" + inside + "\n" + " " * depth + "}" if value else flat

    return lines(everything, 0) + "\n"


def main(manifest: Path) -> None:
    """Rewrite the scenes of ``middlebury.json``.

    Parameters
    ----------
    manifest
        Path of the manifest.

    Raises
    ------
    UserError
        If the manifest contradicts the layouts.
    """
    everything = json.loads(REGISTRY.read_text("utf-8"))
    known = json.loads(manifest.read_text("utf-8"))
    for year in YEARS:
        everything[year]["scenes"] = dict(sorted(scenes(year, known).items()))
    REGISTRY.write_text(text(everything), "utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
