"""Finding and loading scenes by name."""

import os
import re
from collections.abc import Iterable
from fnmatch import fnmatchcase
from glob import glob
from pathlib import Path

from matbench import plugins
from matbench.dataset import Dataset, Listing
from matbench.errors import UserError, unknown
from matbench.scene import Scene
from matbench.spec import Spec, expand, parse

DATA_VARIABLE = "MATBENCH_DATA"

OWN = "folder"
"""The dataset that loads a scene from the folder of a path; every name that is a path is its."""


def data_root(data: str | Path | None = None) -> Path | None:
    """The folder of real scenes: `data`, else what MATBENCH_DATA names, else none.

    Raises
    ------
    UserError
        If it is named but is no folder.
    """
    named = data or os.environ.get(DATA_VARIABLE) or None
    if named is None:
        return None
    root = Path(named).expanduser()
    if not root.is_dir():
        by = "--data" if data else DATA_VARIABLE
        raise UserError(f"data folder {str(root)!r} ({by}) does not exist: name the folder that holds middlebury/")
    return root.resolve()


def own_folder(name: str) -> str | None:
    """The folder that a scene's name means, as it is always written; None if it names no folder.

    A path begins with ``/``, ``.`` or ``~``, or is one that exists and no DATASET/SCENE; written as
    ``folder/PATH`` it is a path in any case. A relative path is written as ``./PATH`` or ``../PATH``.
    """
    prefix, _, rest = name.partition("/")
    if prefix == OWN and rest:
        name = rest
    elif not name.startswith(("/", ".", "~")) and (prefix in plugins.installed("datasets") or not os.path.isdir(name)):  # noqa: PTH112
        return None
    path = os.path.normpath(os.path.expanduser(name))  # noqa: PTH111 (as text: what is typed stays recognizable)
    return path if path.startswith((os.sep, "..")) else os.path.join(".", path)  # noqa: PTH118


def _folders(pattern: str) -> list[str]:
    """The folders that a pattern of paths matches."""
    found = glob(own_folder(pattern) or pattern)  # noqa: PTH207
    return [path for path in sorted(found) if os.path.isdir(path)]  # noqa: PTH112


def _dataset(prefix: str) -> Dataset:
    known = plugins.installed("datasets")
    if prefix not in known:
        raise unknown("dataset", prefix, known)
    loaded: Dataset = known[prefix].load()
    return loaded


def listings(data: str | Path | None = None) -> dict[str, Listing | UserError]:
    """Every known scene by its full name; a dataset that cannot be imported by its error."""
    root = data_root(data)
    found: dict[str, Listing | UserError] = {}
    for prefix, plugin in plugins.installed("datasets").items():
        try:
            found |= {f"{prefix}/{listing.name}": listing for listing in plugin.load().listings(root)}
        except UserError as error:
            found[prefix] = error
        except Exception as error:  # a plug-in's own failure harms no other
            found[prefix] = UserError(f"dataset {prefix!r} from {plugin.source}: {type(error).__name__}: {error}")
    return found


def select(selectors: str | Iterable[str], data: str | Path | None = None) -> list[str]:
    """The names of the scenes that selectors mean; patterns match scenes that are present.

    Raises
    ------
    UserError
        For a malformed selector, or a pattern that matches no scene present.
    """
    names: dict[str, None] = {}
    for spec in expand(selectors):
        if not re.search(r"[*?]", spec.name):
            names[str(spec)] = None
            continue
        known = listings(data)
        hits = [name for name in known if fnmatchcase(name, spec.name)]
        if not hits and (folders := _folders(spec.name)):
            names |= {str(Spec(folder, spec.options)): None for folder in folders}
            continue
        present = [name for name in hits if isinstance(known[name], Listing) and known[name].present]  # type: ignore[union-attr]
        if not present:
            where = "are known but not under the data folder" if hits else "exists"
            which = (
                f"{len(hits)} scenes that {spec.name!r} matches {where}" if hits else f"no scene {spec.name!r} {where}"
            )
            raise UserError(f"{which}: see 'matbench list', and give the data folder by --data or {DATA_VARIABLE}")
        names |= {str(Spec(name, spec.options)): None for name in present}
    return list(names)


def load_scene(name: str, data: str | Path | None = None) -> Scene:
    """Load a scene, such as ``middlebury2003/teddy[views=0:9:2]``.

    Parameters
    ----------
    name
        ``dataset/scene`` or the path of a folder, options in brackets; one value for each.
    data
        The folder of real scenes; without it the one that MATBENCH_DATA names.

    Raises
    ------
    UserError
        If the name or an option is unknown, or its files are missing or damaged.
    """
    specs = parse(name)
    if len(specs) != 1:
        raise UserError(f"{name!r} names {len(specs)} scenes: give one value for each option")
    if (folder := own_folder(specs[0].name)) is not None:
        return _dataset(OWN).load(folder, specs[0].options, None)
    prefix, slash, rest = specs[0].name.partition("/")
    if not slash or not rest:
        raise UserError(
            f"scene {name!r} has no dataset: write DATASET/SCENE, such as 'synthetic/box', or a path, ./{name}"
        )
    return _dataset(prefix).load(rest, specs[0].options, data_root(data))
