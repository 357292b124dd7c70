"""What a mean over scenes of several kinds is over: every scene weighs the same, so a kind weighs as many as it has."""

import re
from collections import Counter
from collections.abc import Sequence

from matbench.spec import witness

_NUMBERED = re.compile(r"-[0-9]+$")


def mixture(scenes: Sequence[str]) -> str:
    """How many of the scenes are of which kind; empty if all are of one.

    A kind is a dataset. Of one whose scenes are told apart by a number at the end, such as random worlds, it is what
    stands before the number; the dataset again where that is the same for all.

    >>> mixture(["a/x", "b/y", "b/z"])
    'a 1, b 2'
    >>> mixture(["a/x", "b/world-1", "b/world-thin-2[n=5]", "b/world-thin-3", "b/box"])
    'a 1, b/world 1, b/world-thin 2, b/box 1'
    >>> mixture(["a/x", "b/world-1", "b/world-2"]), mixture(["b/world-1", "b/world-2"])
    ('a 1, b 2', '')
    """
    names = [witness(scene) for scene in scenes]
    families: dict[str, set[str]] = {}
    for name in names:
        families.setdefault(_dataset(name), set()).add(_NUMBERED.sub("", name))
    numbered = {_dataset(name) for name in names if _NUMBERED.search(name)}
    told = {dataset for dataset, some in families.items() if dataset in numbered and len(some) > 1}
    counts = Counter(_NUMBERED.sub("", name) if _dataset(name) in told else _dataset(name) for name in names)
    return ", ".join(f"{kind} {count}" for kind, count in counts.items()) if len(counts) > 1 else ""


def _dataset(name: str) -> str:
    return name.partition("/")[0]
