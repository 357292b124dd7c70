"""Exact counters of work, compared with those in tests/benchmarks/counters.json.

Counters are the first layer of `matbench bench`: they are the same on every machine, so any change is real.
"""

import json
from collections.abc import Mapping

from matbench.bench.measuring import BENCHMARKS, Tree, run_program
from matbench.errors import UserError
from matbench.files.documents import read_json

_MOST = 1 << 22  # bytes of stored counters

Work = Mapping[str, Mapping[str, int]]
"""Method -> counter -> count."""


def counted(tree: Tree) -> Work:
    """Count the methods' work on their scenes, in a fresh process."""
    found: Work = run_program(tree, "work")
    return found


def stored(tree: Tree) -> Work:
    """The counters that were last accepted (`matbench bench --update`).

    Raises
    ------
    UserError
        If the file is missing or damaged.
    """
    path = tree.code / BENCHMARKS / "counters.json"
    try:
        found: Work = read_json(path, most=_MOST)
    except (OSError, ValueError) as error:
        raise UserError(f"{path} cannot be read: matbench bench --update writes it") from error
    return found


def store(tree: Tree, work: Work) -> None:
    """Accept these counters: store them."""
    (tree.code / BENCHMARKS / "counters.json").write_text(json.dumps(work, indent=1) + "\n", encoding="utf-8")


def changes(before: Work, now: Work) -> list[str]:
    """The counters that differ, one a line, such as ``sgbm: pixel_disparities 49,152 -> 98,304``."""
    names = {(method, name) for work in (before, now) for method, counts in work.items() for name in counts}
    pairs = [
        (f"{method}: {name}", before.get(method, {}).get(name), now.get(method, {}).get(name))
        for method, name in sorted(names)
    ]
    return [f"{what} {_shown(old)} -> {_shown(new)}" for what, old, new in pairs if old != new]


def _shown(count: int | None) -> str:
    return "nothing" if count is None else f"{count:,}"
