"""The folder of real scenes, as whoever runs the tests has it: all of them, some of them, or none."""

from pathlib import Path

import pytest
from attrs import frozen

from matbench.errors import UserError
from matbench.scenes.catalogue import listings
from matbench.spec import parse


@frozen
class Real:
    """The folder of real scenes. A test names what it needs of it, and is skipped where that is not there."""

    root: Path

    def __call__(self, *needed: str) -> Path:
        """The folder, if it has all that is needed: scenes, with their size if it counts, or paths below it."""
        for one in needed:
            if not self.has(one):
                pytest.skip(f"no {one} among the real scenes")
        return self.root

    def has(self, needed: str) -> bool:
        if (self.root / needed).exists():
            return True
        (spec,) = parse(needed)
        listing = listings(self.root).get(spec.name)
        if listing is None or isinstance(listing, UserError):
            return False
        return listing.present if "size" not in spec.options else spec.options["size"] in (listing.complete or ())
