"""Which file of a folder is the map of which view of a scene: the names that people give them."""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path

from matbench.errors import UserError
from matbench.files.maps import ENDINGS
from matbench.scene import Scene
from matbench.spec import read_scene

PATTERNS = ("{scene}", "{scene}_{view}", "{scene}-{view}", "{scene}/{view}", "{scene}/disp{view}", "{scene}/disp")
"""Names that are looked for, without endings. ``{scene}`` is the scene's name with and without its dataset, and
``{view}`` a view's label or the number in it; a name without ``{view}`` is the reference view's."""

_ONLY = "{scene}/disp0"
"""The left view of a pair, as Middlebury's own results are called: the reference view's if there is no other map."""


def find(folder: Path, scene: Scene, pattern: str = "") -> Mapping[int, Path]:
    """View index -> the file of its map, for every view that has one; the reference view is among them.

    Parameters
    ----------
    pattern
        One name to look for instead of `PATTERNS`; with its ending if it has one.

    Raises
    ------
    UserError
        If there is none of the reference view, or two of one view.
    """
    found: dict[int, Path] = {}
    for view in range(scene.n):
        files = list(dict.fromkeys(_files(folder, scene, view, pattern)))
        if len(files) > 1:
            two = ", ".join(str(file.relative_to(folder)) for file in files[:2])
            raise UserError(f"{folder} has two maps of {scene.name}, view {scene.labels[view]}: {two}; leave one")
        if files:
            found[view] = files[0]
    if scene.ref not in found and not pattern:
        alone = [file for name in names(scene) for file in _of_name(folder, _filled(_ONLY, name))]
        if len(alone) == 1 and not set(found.values()) - set(alone):
            return {scene.ref: alone[0]}
    if scene.ref not in found:
        label = scene.labels[scene.ref]
        tried = [pattern] if pattern else [*PATTERNS[:4], "..."]
        raise UserError(
            f"{folder} has no map of {scene.name}, view {label}: looked for "
            f"{', '.join(dict.fromkeys(_filled(one, names(scene)[-1], label) for one in tried))}, as "
            f"{', '.join(ending[1:] for ending in ENDINGS)}"
        )
    return found


def names(scene: Scene) -> list[str]:
    """What a scene may be called: with its options, with its dataset, and without either."""
    plain = read_scene(scene.name).name
    short = plain.rstrip("/").rpartition("/")[2]
    return list(dict.fromkeys([scene.name, plain, scene.name.rpartition("/")[2], short]))


def _files(folder: Path, scene: Scene, view: int, pattern: str) -> Iterator[Path]:
    label = scene.labels[view]
    labels = dict.fromkeys([label, *re.findall(r"\d+", label)[-1:]])
    for one in [pattern] if pattern else PATTERNS:
        if "{view}" not in one and view != scene.ref:
            continue
        for name in names(scene):
            for called in labels if "{view}" in one else [""]:
                yield from _of_name(folder, _filled(one, name, called))


def _filled(pattern: str, name: str, view: str = "") -> str:
    """A pattern is a user's text: `str.format` would fail at other brackets, and look into objects."""
    return pattern.replace("{scene}", name).replace("{view}", view)


def _of_name(folder: Path, name: str) -> Iterator[Path]:
    """The files of that name, with any of `ENDINGS` if it has none."""
    if name.startswith("/") or ".." in Path(name).parts or "\0" in name:
        return
    whole = folder / name
    for path in [whole] if whole.suffix.lower() in ENDINGS else [Path(f"{whole}{end}") for end in ENDINGS]:
        if path.is_file():
            yield path
