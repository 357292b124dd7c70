"""What the tables of a run were made by and from, so that stale ones are recognised."""

import json
from collections.abc import Mapping
from functools import cache
from hashlib import sha256
from pathlib import Path

from attrs import asdict, frozen
from cattrs.preconf.json import make_converter

from matbench import code
from matbench.files.writing import write_text
from matbench.plans import plan as plans
from matbench.plans import plugins
from matbench.plans.plan import Plan
from matbench.runs.store import Store
from matbench.scene import Scene

FILE = "scores.json"
TABLES = ("results.csv", "cells.csv")
_json = make_converter()


@cache
def digest() -> str:
    """Sixteen hexadecimal digits over all code that turns maps into scores, that of plug-ins' metrics included."""
    parts = [
        code.of_file(
            Path(__file__).with_name("scores.py"), alone=True
        ).digest,  # not the store and the plan that it reads
        code.of_module("matbench.regions").digest,
        *sorted(plugins.code_digest(plugin) for plugin in plugins.installed("metrics").values()),
    ]
    return plans.digest(parts)


@frozen
class Made:
    """How the tables of a run were made.

    Parameters
    ----------
    scorer
        `digest` of the code.
    truth
        Scene -> digest of its ground truth and regions (`Scene.truth_digest`).
    cells
        Digest of what was scored: the cells, how each ended, its maps.
    tables
        File -> SHA-256.
    """

    scorer: str
    truth: Mapping[str, str]
    cells: str
    tables: Mapping[str, str]


def record(plan: Plan, store: Store, scenes: Mapping[str, Scene]) -> None:
    """Write down how the tables that lie in a run's folder were made, just now."""
    truth = {cell.scene: scenes[cell.scene].truth_digest for cell in plan.cells}
    made = Made(digest(), truth, _cells(plan, store), {name: _sha256(store.folder / name) for name in TABLES})
    write_text(store.folder / FILE, json.dumps(asdict(made), indent=1))


def made(store: Store) -> Made | None:
    """How the tables of a run were made, or None if nobody knows."""
    try:
        return _json.structure(json.loads((store.folder / FILE).read_text(encoding="utf-8")), Made)
    except Exception:  # whatever a damaged one raises
        return None


def fault(plan: Plan, store: Store) -> str:
    """Why the tables of a run cannot be relied on, in words; empty if they can."""
    found = made(store)
    if found is None:
        return "there are none that say how they were made"
    if found.scorer != digest():
        return f"they were made by another scorer ({found.scorer}, not {digest()})"
    if any(_sha256(store.folder / name) != found.tables.get(name) for name in TABLES):
        return "they are not as they were written"
    if found.cells != _cells(plan, store):
        return "cells were computed since"
    return ""


def _cells(plan: Plan, store: Store) -> str:
    outcomes = [(cell.key, store.outcome(cell, whole=False)) for cell in plan.cells]
    return plans.digest(sorted((key, o.status, o.maps) for key, o in outcomes if o is not None))


def _sha256(path: Path) -> str:
    try:
        return sha256(path.read_bytes()).hexdigest()
    except FileNotFoundError:
        return ""
