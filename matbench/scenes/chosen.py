"""The scenes of a comparison: chosen by their names, read, and checked before anything runs."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from attrs import frozen

from matbench import spec
from matbench.errors import UserError
from matbench.measures.prediction import instead_of_truth
from matbench.plans import plugins
from matbench.scene import NotInScene, Scene
from matbench.scenes.catalogue import Selection, default_scenes, is_pattern, load_scene, select
from matbench.scenes.scene_check import beyond_range
from matbench.shelf import Shelf


@frozen(eq=False)
class Chosen:
    """Scenes, each once; as many in memory as there is room for.

    Parameters
    ----------
    scenes
        Name -> scene.
    spellings
        Another name of a chosen scene -> the name under which it stands in `scenes`.
    left_out
        Reason -> scenes that a pattern matches but that cannot be compared.
    """

    scenes: Mapping[str, Scene]
    spellings: Mapping[str, str]
    left_out: Mapping[str, Sequence[str]]


def choose(
    selectors: str | Sequence[str] | None,
    root: Path | None,
    rows: Iterable[int] = (),
    known: Mapping[str, Scene] = MappingProxyType({}),
) -> Chosen:
    """Read the scenes that selectors mean; the default scenes, if there are none.

    Parameters
    ----------
    root
        The folder of real scenes.
    rows
        Image rows that every scene must have.
    known
        Scenes that have been read before, by name.

    Raises
    ------
    UserError
        If there are none, or one of them cannot be read, or cannot be scored, or lacks a row.
    """
    selected = select(selectors, root) if selectors is not None else Selection(tuple(default_scenes(root)[0]))
    if not selected.names:
        raise UserError("nothing to compare: name at least one algorithm and one scene")
    named = {str(one) for one in spec.expand(selectors or ()) if not is_pattern(one.name)}
    files = plugins.used()
    shelf = Shelf(lambda name: load_scene(name, root, files or None))
    loaded: dict[tuple[str, str], str] = {}  # a scene spelled in two ways is one scene: digests -> its name
    spellings: dict[str, str] = {}
    left_out = {reason: list(names) for reason, names in selected.left_out.items()}
    for name in selected.names:
        if isinstance(known, Shelf) and name in known:
            kept = loaded.setdefault((known.facts[name].digest, known.facts[name].truth_digest), name)
            if kept == name:
                shelf.take(known, name)
            else:
                spellings[name] = kept
            continue
        try:
            scene = known[name] if name in known else load_scene(name, root)
        except NotInScene:
            if name in named:
                raise
            left_out.setdefault("the scenes have not these views", []).append(name)
            continue
        _check(scene, name, rows)
        kept = loaded.setdefault((scene.digest, scene.truth_digest), scene.name)
        if kept != scene.name:
            spellings[scene.name] = kept
        elif scene.name not in shelf:
            shelf.put(scene, beyond_range(scene) or "")
        elif (scene.digest, scene.truth_digest) != (shelf.facts[kept].digest, shelf.facts[kept].truth_digest):
            raise UserError(f"two different scenes are called {kept}: scores of both cannot stand in one table")
    if not loaded:
        raise UserError(f"no scene has the views asked for: {', '.join(selected.names)}")
    return Chosen(shelf, spellings, left_out)


def _check(scene: Scene, name: str, rows: Iterable[int]) -> None:
    """Raise UserError if a scene cannot be scored, or lacks one of the rows."""
    if scene.ref not in scene.truth and scene.held_out is None:
        ref = scene.labels[scene.ref]
        raise UserError(f"{name} has no ground truth of its reference view {ref}: it needs {instead_of_truth(scene)}")
    for row in rows:
        if not 0 <= row < scene.height:
            raise UserError(f"row {row} of {name}: 0 to {scene.height - 1} is possible")
