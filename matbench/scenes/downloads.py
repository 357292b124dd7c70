"""Which scenes can be fetched, by their names, and the folder that they go to."""

import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path

from matbench.errors import UserError, unknown
from matbench.files.own_folders import data_folder, expanded
from matbench.plans import plugins
from matbench.scenes.catalogue import DATA_VARIABLE, group, is_pattern
from matbench.scenes.dataset import Download, loaded
from matbench.spec import expand


def fetch_root(data: str | Path | None = None) -> Path:
    """Where downloaded scenes go: `data`, else what MATBENCH_DATA names, else the person's own folder.

    Unlike `matbench.scenes.catalogue.data_root`, it need not exist yet.

    Raises
    ------
    UserError
        If it is there but no folder, or the person has no folder of their own.
    """
    root = expanded(data or os.environ.get(DATA_VARIABLE) or data_folder())
    if root.exists() and not root.is_dir():
        raise UserError(f"data folder {str(root)!r} is a file: name a folder, or one to be made")
    return root.resolve()


def offered() -> dict[str, Mapping[str, Download]]:
    """Every scene that can be fetched: scene's full name -> size -> its files. The default size comes first."""
    found: dict[str, Mapping[str, Download]] = {}
    for prefix, plugin in plugins.datasets().items():
        with suppress(UserError):  # one that cannot be imported is shown by `matbench list`
            dataset = loaded(plugin)
            if hasattr(dataset, "downloads"):
                found |= {f"{prefix}/{name}": sizes for name, sizes in dataset.downloads().items()}
    return found


def downloads(selectors: str | Iterable[str]) -> tuple[list[Download], list[str]]:
    """The scenes that selectors mean, whether they are already there or not.

    Returns
    -------
    The files of each scene; and a line for each scene that a pattern also matches but that cannot be
    fetched, with the reason.

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
        names = group(spec.name, known) if is_pattern(spec.name) else [_fetchable(spec.name, known)]
        fit = {name: _of_size(known[name], size) for name in names}
        found |= {one.name: one for one in fit.values() if one is not None}
        others = [f"{name}: {_sizes_in_words(known[name], size)}" for name, one in fit.items() if one is None]
        if len(others) == len(names):
            raise UserError("; ".join(others) or f"no scene that can be fetched is called {spec.name!r}")
        left_out += others
    return list(found.values()), left_out


def _fetchable(name: str, known: Iterable[str]) -> str:
    """The name itself, if it is that of a scene that can be fetched."""
    datasets = plugins.datasets()
    prefix, _, rest = name.partition("/")
    if not rest:
        raise UserError(f"scene {name!r} has no dataset: write DATASET/SCENE, such as 'middlebury2003/teddy'")
    if prefix not in datasets:
        raise unknown("dataset", prefix, datasets)
    if not hasattr(loaded(datasets[prefix]), "downloads"):
        raise UserError(f"{name} cannot be fetched: the scenes of {prefix} are not downloaded")
    if name not in known:
        raise unknown("scene", name, (one for one in known if one.startswith(f"{prefix}/")))
    return name


def _of_size(sizes: Mapping[str, Download], size: str | None) -> Download | None:
    return sizes.get(size) if size is not None else next(iter(sizes.values()), None)


def _sizes_in_words(sizes: Mapping[str, Download], size: str | None) -> str:
    known = f"known: {', '.join(sizes)}" if sizes else "none of its files is known"
    return known if size is None else f"size {size} is not known, {known}"
