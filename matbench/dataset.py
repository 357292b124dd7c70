"""Where scenes come from: what a dataset plug-in offers."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Protocol

from attrs import frozen

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
        Option value -> (width, height) in pixels; the default size first.
    present
        Can it be loaded now, in its default size?
    """

    name: str
    views: int
    sizes: Mapping[str, tuple[int, int]]
    present: bool


class Dataset(Protocol):
    """A family of scenes under one prefix: the name of its entry point, such as ``middlebury2003``."""

    def listings(self, root: Path | None) -> Sequence[Listing]:
        """All scenes that it knows, whether they are under `root` or not."""
        ...

    def load(self, name: str, options: Mapping[str, str], root: Path | None) -> Scene:
        """Load one scene, its `regions` filled in.

        Parameters
        ----------
        name
            Without the prefix.
        options
            What stood in brackets: ``{"views": "0:9:2", "size": "half"}``.
        root
            The folder of real scenes (``--data`` or MATBENCH_DATA), if there is one.

        Raises
        ------
        UserError
            For an unknown name, option or value, and for missing or damaged files.
        """
        ...
