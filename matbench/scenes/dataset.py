"""Where scenes come from: what a dataset plug-in offers."""

import shlex
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import Protocol

from attrs import frozen

from matbench.errors import UserError, failure
from matbench.plans.plugins import Plugin
from matbench.scene import Scene


@frozen
class Listing:
    """One scene as `matbench list` shows it.

    Parameters
    ----------
    name
        Without the dataset's prefix: ``teddy``.
    views
        How many views it has.
    sizes
        Value of the option ``size`` -> (width, height) in pixels; the default size comes first.
    present
        Can it be loaded now, in its default size?
    complete
        The sizes in which it can be loaded now, where a dataset tells them apart.
    truth
        Does it have ground truth, so that methods can be scored on it?
    endless
        Is it one of any number of scenes, told apart by their option ``seed``? No pattern matches it.
    """

    name: str
    views: int
    sizes: Mapping[str, tuple[int, int]]
    present: bool
    complete: Collection[str] | None = None
    truth: bool = True
    endless: bool = False


@frozen
class Remote:
    """A file that can be downloaded.

    Parameters
    ----------
    name
        What it is called, without folder.
    bytes, sha256
        Its size and digest.
    also
        Other names under which the same content may lie, such as ``im0.png`` for ``im0.ppm``.
    offered_as
        Further names that a site may use for it. It is then renamed to `name`, with the site's suffix.
    holds
        Asked of a file whose digest differs: does it hold the same content all the same, such as the same
        pixels in another format?
    """

    name: str
    bytes: int
    sha256: str
    also: tuple[str, ...] = ()
    offered_as: tuple[str, ...] = ()
    holds: Callable[[Path], bool] = lambda _: False

    @property
    def names(self) -> tuple[str, ...]:
        return (self.name, *self.also)


@frozen
class Download:
    """Where the files of one scene in one size can be downloaded, and where they go.

    Parameters
    ----------
    name
        Of the scene, dataset and size included: ``middlebury2003/teddy[size=half]``.
    folder
        Where the files go, below the data root.
    site
        URL that `sources` start from, ending in a slash; a mirror takes its place.
    sources
        Zip archives with all or some of the files, and folders of single files (these end in a
        slash), the best first.
    """

    name: str
    folder: PurePosixPath
    files: tuple[Remote, ...]
    site: str
    sources: tuple[str, ...]

    @property
    def command(self) -> str:
        """The command that downloads it, as a user types it."""
        return shlex.join(["matbench", "fetch", self.name])


class Dataset(Protocol):
    """A family of scenes under one prefix: the name of its entry point, such as ``middlebury2003``.

    In a file of one's own, a class that takes no arguments; the prefix is its name in snake case.

    One with sets of scenes also has ``sets() -> Mapping[str, Sequence[str]]``: name of the set, such as
    ``worlds/quick``, which begins with no dataset's prefix -> its scenes in order, prefix included. Their options may
    stand in brackets after them. A set can be named wherever a scene can.

    One whose scenes can be downloaded also has ``downloads() -> Mapping[str, Mapping[str, Download]]``:
    scene without prefix -> size, the default first -> its files; `matbench fetch` then brings them.
    """

    def listings(self, root: Path | None) -> Sequence[Listing]:
        """All scenes that it knows, whether they are under `root` or not."""
        ...

    def load(self, name: str, options: Mapping[str, str], root: Path | None) -> Scene:
        """Load one scene, called ``prefix/name``, options in brackets.

        Where it has truth but no `regions`, these are filled in as of the field's pair (`matbench.regions.regions`).

        Parameters
        ----------
        name
            Without the prefix.
        options
            What stood in brackets: ``{"views": "0:9:2", "size": "half"}``.
        root
            The folder of real scenes (`matbench.scenes.catalogue.data_root`), if there is one.

        Raises
        ------
        UserError
            For an unknown name, option or value, and for missing or damaged files.
        """
        ...


def loaded(plugin: Plugin) -> Dataset:
    """The dataset that a plug-in offers: it may be a class that takes no arguments.

    Raises
    ------
    UserError
        If it cannot be had.
    """
    found = plugin.load()
    if not isinstance(found, type):
        return found  # type: ignore[no-any-return]
    try:
        return found()  # type: ignore[no-any-return]
    except Exception as error:
        raise UserError(f"dataset {plugin.name!r} from {plugin.source}: {failure(error)}") from error
