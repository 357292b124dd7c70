"""Random worlds by name, and sets of them.

``synthetic/world[seed=7]`` is called ``synthetic/world-7``, and ``synthetic/world[family=thin seed=7]``
``synthetic/world-thin-7``: what decides the world belongs to its name, as another seed is another scene. What stands
in brackets after the name changes how the same world is seen.
"""

import re
from collections.abc import Mapping, Sequence

from matbench.datasets.synthetic import asking
from matbench.datasets.synthetic.asking import OPTIONS, Asked
from matbench.datasets.synthetic.cameras import heights
from matbench.datasets.synthetic.families import FAMILIES
from matbench.datasets.synthetic.random_worlds import draw
from matbench.datasets.synthetic.stage import Stage
from matbench.errors import UserError, unknown
from matbench.scene import Range

NAME = "world"
MIXED = next(iter(FAMILIES))
QUICK_SIZE = "160x120"

SETS: Mapping[str, Sequence[str]] = {
    "worlds/quick": [f"synthetic/{NAME}-{seed}[size={QUICK_SIZE}]" for seed in range(12)],
    "worlds/standard": [f"synthetic/{NAME}-{seed}" for seed in range(100)],
    "worlds/large": [f"synthetic/{NAME}-{seed}" for seed in range(1000)],
}
"""Name -> the scenes of the set, in order."""


def read(name: str, options: Mapping[str, str]) -> Asked | None:
    """A random world as it was asked for; None if the name is none of a world."""
    found = re.fullmatch(rf"{NAME}(?:-([a-z]+))?(?:-([0-9]{{1,10}}))?", name)
    if not found:
        return None
    called = f"synthetic/{name}"
    asking.check_options(called, options, (*OPTIONS, "family"))
    given = {key: value for key, value in zip(("family", "seed"), found.groups(), strict=True) if value is not None}
    for key in given:
        if key in options:
            raise UserError(f"{key}={options[key]} of {called}: its name says {key}={given[key]} already")
    told = {**options, **given}
    family = told.get("family", MIXED)
    if family not in FAMILIES:
        raise unknown(f"family of synthetic/{NAME}", family, FAMILIES)
    seed = asking.number(called, told, "seed", 0, 0, 2**31 - 1)
    drawn = draw(seed, family)
    n = asking.number(called, options, "n", drawn.views, 2, 25)
    own = n == drawn.views
    ref, steps = (drawn.ref, drawn.steps) if own else (n // 2, max(1, n - 1 - n // 2))
    width, height = asking.size(called, options)
    strengths = asking.strengths(called, options, drawn.strengths)
    lowered = tuple(heights(strengths, seed, n)) or (0.0,) * n
    return Asked(
        called=f"synthetic/{NAME}-{seed}" if family == MIXED else f"synthetic/{NAME}-{family}-{seed}",
        options={key: value for key, value in options.items() if key not in ("family", "seed")},
        n=n,
        width=width,
        height=height,
        seed=seed,
        strengths=strengths,
        ref=ref,
        pair_steps=steps,
        disparities=Range(0, round(drawn.largest * width / steps, 3)),
        cameras=Stage(drawn, n, ref, steps, width, height, lowered),
    )
