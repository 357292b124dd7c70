"""Finding and loading scenes by name."""

import os
import re
import shlex
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from fnmatch import fnmatchcase
from glob import glob
from pathlib import Path

from attrs import evolve, frozen

from matbench.errors import UserError, failure, refuse_hidden, unknown
from matbench.files.own_folders import data_folder, expanded
from matbench.plans import plugins
from matbench.regions import regions
from matbench.scene import Scene
from matbench.scenes import views_only
from matbench.scenes.dataset import Dataset, Listing, loaded
from matbench.spec import Spec, count, expand, label, parse

DATA_VARIABLE = "MATBENCH_DATA"
PAPER_SCENES = ("middlebury2001/tsukuba", "middlebury2006/Rocks1", "middlebury2003/teddy")
DEFAULT_SET = "worlds/quick[size=120x90]"
"""The computed scenes that are taken where none are named: so small that compiling takes longer than solving."""
GROWING_SET = "worlds/large[size=120x90]"
"""The scenes that a run adds, in order, where it grows until it decides and none are named."""
GROUPS: Mapping[str, Sequence[str]] = {"paper": PAPER_SCENES}
"""Words that stand for several scenes in a selector, as a pattern does. Datasets have further ones (`sets`)."""

_SHOWN = 200  # characters of a name in a message
_NO_TRUTH = "no ground truth"


OWN = "folder"
"""The dataset that loads a scene from a folder. Every scene whose name is a path belongs to it."""


def data_root(data: str | Path | None = None) -> Path | None:
    """The folder of real scenes: `data`, else what MATBENCH_DATA names, else the user's data folder if it exists.

    Raises
    ------
    UserError
        If it is named but does not exist.
    """
    named = data or os.environ.get(DATA_VARIABLE) or None
    if named is None:
        with suppress(UserError):  # without a home folder there are no scenes in it
            own = data_folder()
            return own.resolve() if own.is_dir() else None
        return None
    refuse_hidden("data folder", str(named))
    root = expanded(named)
    if not root.is_dir():
        by = "--data" if data else DATA_VARIABLE
        raise UserError(f"data folder {str(root)!r} ({by}) does not exist: name the folder that holds middlebury/")
    return root.resolve()


def own_folder(name: str) -> str | None:
    """The folder that a scene's name means, in its one spelling; None if the name means no folder.

    A name is a path if it begins with ``/``, ``.`` or ``~``, or if it is an existing folder and not
    DATASET/SCENE. ``folder/PATH`` is always a path. In the result, a relative path is ``./PATH`` or ``../PATH``.
    """
    prefix, _, rest = name.partition("/")
    if prefix == OWN and rest:
        name = rest
    elif not name.startswith(("/", ".", "~")) and (prefix in plugins.datasets() or not os.path.isdir(name)):  # noqa: PTH112
        return None
    path = os.path.normpath(os.path.expanduser(name))  # noqa: PTH111 (as text: what is typed stays recognizable)
    return path if path.startswith((os.sep, "..")) else os.path.join(".", path)  # noqa: PTH118


def _each(spec: Spec) -> list[Spec]:
    """The scenes of a folder that a pattern among its options means; as a rule, the one."""
    folder = own_folder(spec.name) if any("*" in value for value in spec.options.values()) else None
    expand = None if folder is None else getattr(_dataset(OWN), "expand", None)
    return [spec] if expand is None else [Spec(spec.name, options) for options in expand(folder, spec.options)]


def _folders(pattern: str) -> list[str]:
    """The folders that a pattern of paths matches."""
    found = glob(own_folder(pattern) or pattern)  # noqa: PTH207
    return [path for path in sorted(found) if os.path.isdir(path)]  # noqa: PTH112


def _dataset(prefix: str) -> Dataset:
    known = plugins.datasets()
    if prefix not in known:
        raise unknown("dataset", prefix, known)
    return loaded(known[prefix])


def listings(data: str | Path | None = None) -> dict[str, Listing | UserError]:
    """Full name -> listing, for every known scene. A dataset that cannot be imported has its error under its name."""
    root = data_root(data)
    found: dict[str, Listing | UserError] = {}
    for prefix, plugin in plugins.datasets().items():
        try:
            found |= {f"{prefix}/{listing.name}": listing for listing in loaded(plugin).listings(root)}
        except UserError as error:
            found[prefix] = error
        except Exception as error:  # a plug-in's own failure harms no other
            found[prefix] = UserError(f"dataset {prefix!r} from {plugin.source}: {failure(error)}")
    return found


@frozen
class Selection:
    """The scenes that selectors mean.

    Parameters
    ----------
    names
        Names of scenes, with their options.
    left_out
        Reason -> scenes that a pattern matches but that cannot be used.
    """

    names: tuple[str, ...]
    left_out: Mapping[str, Sequence[str]] = {}


def sets() -> dict[str, Sequence[str]]:
    """Name -> scenes in order, for every set: ``paper``, and what datasets offer, such as ``worlds/quick``."""
    found: dict[str, Sequence[str]] = {}
    for plugin in plugins.datasets().values():
        with suppress(Exception):  # a plug-in's own failure harms no other; `listings` says what is wrong with it
            offered = getattr(loaded(plugin), "sets", None)
            found |= offered() if offered is not None else {}
    return {**found, **GROUPS}  # a dataset cannot take a name from them


def _is_set(name: str) -> bool:
    if name in GROUPS:
        return True
    prefix, slash, _ = name.partition("/")
    return slash != "" and prefix not in ("", ".", "..", "~") and prefix not in plugins.datasets() and name in sets()


def is_pattern(name: str) -> bool:
    """Does a name stand for all scenes that it matches, or for a set such as ``paper``?"""
    return re.search(r"[*?]", name) is not None or _is_set(name)


def group(name: str, known: Iterable[str]) -> list[str]:
    """The known scenes that a pattern, or a word such as ``paper``, stands for."""
    if name in GROUPS:
        return [one for one in GROUPS[name] if one in set(known)]
    return [one for one in known if fnmatchcase(one, name)]


def select(selectors: str | Iterable[str], data: str | Path | None = None, needs_truth: bool = True) -> Selection:
    """The scenes that selectors mean. Patterns match only scenes that are present and have truth.

    With an option ``size``, a pattern takes the scenes that are present in that size. With ``predict``
    it also takes scenes without truth.

    Parameters
    ----------
    needs_truth
        Are the scenes to be scored? Scenes that are only looked at need no truth.

    Raises
    ------
    UserError
        For a malformed selector, or a pattern that matches no scene present.
    """
    names: dict[str, None] = {}
    left_out: dict[str, list[str]] = {}
    known: dict[str, Listing | UserError] | None = None
    for spec in expand(selectors):
        if not is_pattern(spec.name):
            names |= {str(one): None for one in _each(spec)}
            continue
        if spec.name not in GROUPS and _is_set(spec.name):
            names |= dict.fromkeys(_members(spec))
            continue
        known = known if known is not None else listings(data)
        hits = group(spec.name, known)
        if not hits and (folders := _folders(spec.name)):
            names |= {str(Spec(folder, spec.options)): None for folder in folders}
            continue
        offered = {name: one for name in hits if isinstance(one := known[name], Listing) and not one.endless}
        present = {name: found for name, found in offered.items() if found.present or found.complete}
        why = {name: _unfit(found, spec.options, needs_truth) for name, found in present.items()}
        fit = [name for name, reason in why.items() if not reason]
        if not fit:
            raise _no_match(spec, hits, why)
        for name, reason in why.items():
            if reason and name not in left_out.setdefault(reason, []):
                left_out[reason].append(name)
        names |= {str(Spec(name, spec.options)): None for name in fit}
    return Selection(tuple(names), left_out)


def _members(spec: Spec) -> list[str]:
    """The scenes of a dataset's set; the options after its name replace those of the scenes."""
    return [str(Spec(one.name, {**one.options, **spec.options})) for one in expand(sets()[spec.name])]


def _unfit(listing: Listing, options: Mapping[str, str], needs_truth: bool) -> str:
    """Why a scene cannot be used with those options; empty if it can."""
    size = options.get("size")
    if needs_truth and not listing.truth and "predict" not in options:
        return _NO_TRUTH
    if size is None or listing.complete is None:
        return "" if listing.present else "not complete"
    if size not in listing.sizes:
        return f"no size {size}"
    return "" if size in listing.complete else f"not there in size {size}"


def _no_match(spec: Spec, hits: Sequence[str], unfit: Mapping[str, str]) -> UserError:
    """The error for a pattern without usable scenes. `unfit` gives the reason for each scene that is present."""
    if not hits:
        return UserError(f"no scene {spec.name!r} exists: see 'matbench list'")
    which = f"{len(hits)} scenes that {spec.name!r} matches"
    if unfit:
        which += f": none can be compared ({', '.join(f'{name}: {reason}' for name, reason in unfit.items())})"
        if set(unfit.values()) == {_NO_TRUTH}:
            return UserError(f"{which}: see 'matbench list'")
    else:
        which += " are known but not under the data folder"
    advice = f"give the data folder by --data or {DATA_VARIABLE}"
    if any(hasattr(_dataset(hit.partition("/")[0]), "downloads") for hit in hits):
        size = {key: value for key, value in spec.options.items() if key == "size"}
        advice += f", or bring them with {shlex.join(['matbench', 'fetch', str(Spec(spec.name, size))])}"
    return UserError(f"{which}: {advice}")


def load_scene(
    name: str, data: str | Path | None = None, plugin: str | Path | Sequence[str | Path] | None = None
) -> Scene:
    """Load a scene, such as ``middlebury2003/teddy[views=0:9:2]``.

    Parameters
    ----------
    name
        ``dataset/scene`` or the path of a folder, with options in brackets, one value for each. Besides the
        options of its dataset, every scene has ``predict=left`` and ``predict=right``: that end view is held out.
        In a process in which methods run, another process loads the scene, and it comes without truth
        (`matbench.scenes.views_only`).
    data
        The folder of real scenes; by default the one that MATBENCH_DATA names, else the user's data folder.
    plugin
        Python files that hold further datasets.

    Raises
    ------
    UserError
        If the name or an option is unknown, or its files are missing or damaged.
    """
    if plugin is not None:
        with plugins.using([plugin] if isinstance(plugin, str | Path) else plugin):
            return load_scene(name, data)
    if views_only.wanted():
        return views_only.from_another_process(name, data, plugins.used())
    if (named := count(name)) != 1:
        raise UserError(f"{name[:_SHOWN]!r} names {named} scenes: give one value for each option")
    (asked,) = parse(name)
    if _is_set(asked.name):
        raise UserError(f"{asked.name} is a set of {len(sets()[asked.name])} scenes: name one of them")
    options = dict(asked.options)
    end = options.pop("predict", None)
    scene = _load(asked.name, options, data)
    if end is None:
        return scene
    from matbench.measures.prediction import hold_out

    full = parse(scene.name)[0]
    return evolve(hold_out(scene, end), name=label(full.name, dict(sorted({**full.options, "predict": end}.items()))))


def _load(name: str, options: Mapping[str, str], data: str | Path | None) -> Scene:
    """Load a scene from the dataset that its name, given without options, begins with."""
    if (folder := own_folder(name)) is not None:
        return _dataset(OWN).load(folder, options, None)
    prefix, slash, rest = name.partition("/")
    if not slash or not rest:
        raise UserError(
            f"scene {name!r} has no dataset: write DATASET/SCENE, such as 'synthetic/box', or a path, ./{name}"
        )
    scene = _dataset(prefix).load(rest, options, data_root(data))
    if not scene.name.startswith(f"{prefix}/"):
        raise UserError(
            f"dataset {prefix!r} calls its scene {scene.name!r}: what it loads must be called {prefix}/{rest}"
        )
    if scene.regions or scene.ref not in scene.truth:
        return scene
    partner = scene.pair_steps if scene.steps(scene.n - 1) >= scene.pair_steps else -scene.pair_steps
    return evolve(scene, regions=regions(scene.views[scene.ref], scene.truth[scene.ref], partner))


def growing_scenes(data: str | Path | None = None) -> list[str]:
    """The scenes of a run that grows until it decides, in order, where none are named."""
    return list(select(GROWING_SET, data).names)


def default_scenes(data: str | Path | None = None) -> tuple[list[str], list[str]]:
    """The default scenes, those of `DEFAULT_SET` and the paper's three: those present, and those missing."""
    known = listings(data)
    present = {name for name, listing in known.items() if isinstance(listing, Listing) and listing.present}
    computed = list(select(DEFAULT_SET, data).names)
    paper = [name for name in PAPER_SCENES if name in present]
    return computed + paper, [name for name in PAPER_SCENES if name not in present]
