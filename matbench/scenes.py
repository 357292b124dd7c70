"""Finding and loading scenes by name."""

import os
import re
import shlex
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from fnmatch import fnmatchcase
from pathlib import Path

from attrs import frozen

from matbench import plugins
from matbench.dataset import Dataset, Download, Listing
from matbench.errors import UserError, unknown
from matbench.scene import Scene
from matbench.spec import Spec, expand, parse

DATA_VARIABLE = "MATBENCH_DATA"
PAPER_SCENES = ("middlebury2001/tsukuba", "middlebury2006/Rocks1", "middlebury2003/teddy")
GROUPS = {"paper": PAPER_SCENES}
"""What a selector may name instead of a pattern."""


def user_root() -> Path:
    """This person's own folder of real scenes, where `matbench fetch` puts them; it may not exist yet."""
    import platformdirs

    return platformdirs.user_data_path("matbench", appauthor=False)


def data_root(data: str | Path | None = None) -> Path | None:
    """The folder of real scenes: `data`, else what MATBENCH_DATA names, else `user_root` if it exists.

    Raises
    ------
    UserError
        If it is named but is no folder.
    """
    named = data or os.environ.get(DATA_VARIABLE) or None
    if named is None:
        own = user_root()
        return own.resolve() if own.is_dir() else None
    root = Path(named).expanduser()
    if not root.is_dir():
        by = "--data" if data else DATA_VARIABLE
        raise UserError(f"data folder {str(root)!r} ({by}) does not exist: name the folder that holds middlebury/")
    return root.resolve()


def fetch_root(data: str | Path | None = None) -> Path:
    """Where scenes are put: `data`, else what MATBENCH_DATA names, else the person's own folder.

    Raises
    ------
    UserError
        If it is there but no folder.
    """
    root = Path(data or os.environ.get(DATA_VARIABLE) or user_root()).expanduser()
    if root.exists() and not root.is_dir():
        raise UserError(f"data folder {str(root)!r} is a file: name a folder, or one to be made")
    return root.resolve()


def dataset(prefix: str) -> Dataset:
    """The dataset of that name.

    Raises
    ------
    UserError
        If there is none, or it cannot be imported.
    """
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


@frozen
class Selection:
    """Names of scenes, and in words which others a pattern means but cannot have."""

    names: tuple[str, ...]
    left_out: tuple[str, ...] = ()


def group(name: str, known: Iterable[str]) -> list[str] | None:
    """The names that a pattern, or a name of several scenes such as ``paper``, means; None for a plain name."""
    if name in GROUPS:
        return [one for one in GROUPS[name] if one in set(known)]
    return [one for one in known if fnmatchcase(one, name)] if re.search(r"[*?]", name) else None


def select(selectors: str | Iterable[str], data: str | Path | None = None) -> Selection:
    """The scenes that selectors mean; patterns match scenes that are present and have truth.

    A pattern with a size takes the scenes that are present in it.

    Raises
    ------
    UserError
        For a malformed selector, or a pattern that matches no scene present.
    """
    names: dict[str, None] = {}
    left_out: list[str] = []
    for spec in expand(selectors):
        known: dict[str, Listing | UserError] = {}
        if spec.name in GROUPS or re.search(r"[*?]", spec.name):
            known = listings(data)
        hits = group(spec.name, known)
        if hits is None:
            names[str(spec)] = None
            continue
        size = spec.options.get("size")
        offered = {name: found for name in hits if isinstance(found := known[name], Listing)}
        present = {name: found for name, found in offered.items() if found.present or found.complete}
        why = {name: _unfit(found, size) for name, found in present.items()}
        fit = [name for name, reason in why.items() if not reason]
        if not fit:
            raise _no_match(spec, hits, [f"{name}: {reason}" for name, reason in why.items()])
        left_out += [f"{name}: {reason}" for name, reason in why.items() if reason]
        names |= {str(Spec(name, spec.options)): None for name in fit}
    return Selection(tuple(names), tuple(left_out))


def _unfit(listing: Listing, size: str | None) -> str:
    """Why a scene cannot be compared in that size; empty if it can."""
    if not listing.truth:
        return "no ground truth"
    if size is None or listing.complete is None:
        return "" if listing.present else "not complete"
    if size not in listing.sizes:
        return f"no size {size}"
    return "" if size in listing.complete else f"not there in size {size}"


def _no_match(spec: Spec, hits: Sequence[str], unfit: Sequence[str]) -> UserError:
    if not hits:
        return UserError(f"no scene {spec.name!r} exists: see 'matbench list'")
    fetch = shlex.join(
        ["matbench", "fetch", str(Spec(spec.name, {k: v for k, v in spec.options.items() if k == "size"}))]
    )
    why = f"none can be compared: {', '.join(unfit)}" if unfit else "are known but not under the data folder"
    return UserError(
        f"{len(hits)} scenes that {spec.name!r} matches {why}: see 'matbench list', "
        f"give the data folder by --data or {DATA_VARIABLE}, or bring them with {fetch}"
    )


def offered() -> dict[str, Mapping[str, Download]]:
    """Every scene that can be fetched: name -> size, the default first -> its files."""
    found: dict[str, Mapping[str, Download]] = {}
    for prefix, plugin in plugins.installed("datasets").items():
        with suppress(UserError):  # one that cannot be imported is shown by `matbench list`
            loaded = plugin.load()
            if hasattr(loaded, "downloads"):
                found |= {f"{prefix}/{name}": sizes for name, sizes in loaded.downloads().items()}
    return found


def downloads(selectors: str | Iterable[str]) -> tuple[list[Download], list[str]]:
    """The scenes that selectors mean, present or not; and which others patterns mean, and why those cannot be had.

    Raises
    ------
    UserError
        If a selector is malformed or means nothing that can be fetched.
    """
    known = offered()
    found: dict[str, Download] = {}
    left_out: list[str] = []
    for spec in expand(selectors):
        for option in spec.options:
            if option != "size":
                raise unknown(f"option of fetch in {str(spec)!r}", option, ["size"])
        size = spec.options.get("size")
        several = group(spec.name, known)
        names = several if several is not None else [_fetchable(spec.name, known)]
        fit = {name: _of_size(known[name], size) for name in names}
        found |= {one.name: one for one in fit.values() if one is not None}
        others = [f"{name}: {_sizes_in_words(known[name], size)}" for name, one in fit.items() if one is None]
        if len(others) == len(names):
            raise UserError("; ".join(others) or f"no scene that can be fetched is called {spec.name!r}")
        left_out += others
    return list(found.values()), left_out


def _fetchable(name: str, known: Iterable[str]) -> str:
    """The name itself, if it is that of a scene that can be fetched."""
    prefix, _ = _parts(name)
    if not hasattr(dataset(prefix), "downloads"):
        raise UserError(f"{name} cannot be fetched: the scenes of {prefix} are not downloaded")
    if name not in known:
        raise unknown("scene", name, (one for one in known if one.startswith(f"{prefix}/")))
    return name


def _of_size(sizes: Mapping[str, Download], size: str | None) -> Download | None:
    return sizes.get(size) if size is not None else next(iter(sizes.values()), None)


def _sizes_in_words(sizes: Mapping[str, Download], size: str | None) -> str:
    known = f"known: {', '.join(sizes)}" if sizes else "none of its files is known"
    return known if size is None else f"size {size} is not known, {known}"


def _parts(name: str) -> tuple[str, str]:
    """A scene's dataset and its name there."""
    prefix, _, rest = name.partition("/")
    if not rest:
        raise UserError(f"scene {name!r} has no dataset: write DATASET/SCENE, such as 'synthetic/box'")
    return prefix, rest


def load_scene(name: str, data: str | Path | None = None) -> Scene:
    """Load a scene, such as ``middlebury2003/teddy[views=0:9:2]``.

    Parameters
    ----------
    name
        ``dataset/scene``, options in brackets; one value for each.
    data
        The folder of real scenes; without it the one that MATBENCH_DATA names, else the person's own.

    Raises
    ------
    UserError
        If the name or an option is unknown, or its files are missing or damaged.
    """
    specs = parse(name)
    if len(specs) != 1:
        raise UserError(f"{name!r} names {len(specs)} scenes: give one value for each option")
    prefix, rest = _parts(specs[0].name)
    return dataset(prefix).load(rest, specs[0].options, data_root(data))
