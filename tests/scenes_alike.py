"""Are two scenes the same to the bit?"""

from collections.abc import Mapping

import numpy as np
from attrs import fields

from matbench.scene import Scene


def alike(one: Scene, other: Scene) -> None:
    """All that a scene holds is the same to the bit, in the same order."""
    for name in (each.name for each in fields(Scene)):
        a, b = getattr(one, name), getattr(other, name)
        if isinstance(a, Mapping):
            assert list(a) == list(b), name
            pairs = [(a[key], b[key]) for key in a]
        elif isinstance(a, np.ndarray):
            pairs = [(a, b)]
        else:
            assert repr(a) == repr(b), name
            continue
        for left, right in pairs:
            assert (left.dtype, left.shape, left.tobytes()) == (right.dtype, right.shape, right.tobytes()), name
    assert (one.digest, one.truth_digest) == (other.digest, other.truth_digest)
