"""Stale tables are recognised: with the tables is kept which code made them, from which cells and scenes."""

import json
import shlex
from collections.abc import Mapping
from functools import cache
from hashlib import sha256
from operator import itemgetter
from pathlib import Path
from typing import Any

from attrs import asdict, frozen
from cattrs.preconf.json import make_converter

from matbench import code
from matbench.files.csv_tables import LARGEST
from matbench.files.documents import read_json
from matbench.files.plain import NotPlain, digest_plain
from matbench.files.writing import is_writable, write_text
from matbench.plans import plan as plans
from matbench.plans import plugins
from matbench.plans.plan import Plan
from matbench.results.deciding import Ended
from matbench.runs.outcome import Outcome
from matbench.runs.store import Store
from matbench.scene import Scene
from matbench.shelf import facts_of

FILE = "scores.json"
TABLES = ("results.csv", "cells.csv", "reliability.csv", "sparsification.csv")
PAGE = "report.html"
_DRAWING, _SOURCES = ("reports", "recording", "results", "measures"), (".py", ".j2", ".css", ".js", ".csv", ".toml")

_MOST_BYTES = 1 << 26  # of `FILE`

_json = make_converter()


def own_digest() -> str:
    """Digest of the users' own files that are in use and hold metrics; empty if there are none."""
    files = [file for file in plugins.used() if plugins.own_metrics(file)]
    return plans.digest(sorted(plugins.code_digest(plugins.Plugin("", str(f), object)) for f in files)) if files else ""


@cache
def digest() -> str:
    """Sixteen hexadecimal digits over all code that turns maps into scores, metrics of installed plug-ins included."""
    # `alone`, without what it imports: a change of the store or the plan changes no score; metrics are added below
    own = [code.of_file(Path(__file__).with_name(name), alone=True) for name in ("scores.py", "metric_catalogue.py")]
    parts = [*(one.digest for one in own), code.of_module("matbench.regions").digest]
    parts += sorted(plugins.code_digest(plugin) for plugin in plugins.installed("metrics").values())
    return plans.digest(parts)


def by() -> str:
    """The code that makes scores in this process: `digest` and, if there are own metrics, ``+`` and `own_digest`."""
    return "+".join(filter(None, (digest(), own_digest())))


@frozen
class Made:
    """How the tables of a run were made.

    Parameters
    ----------
    scorer
        `digest` of the code.
    own
        `own_digest`. It is kept apart from `scorer`, because users' own files are read only if they are named.
    truth
        Scene -> digest of its ground truth and regions (`Scene.truth_digest`).
    cells
        Digest of what was scored: the cells, what tables call their methods, and their outcomes, which hold the digests
        of their maps.
    tables
        File -> SHA-256; empty for a file that does not exist.
    unsteady
        The cells whose repeats differ, a line each (`matbench.results.scores.Tables`).
    page
        `page_digest` of the report; empty until it is drawn.
    metrics
        The metrics that were computed besides those of every run.
    ended
        How the run ended, if it grew until a difference was decided.
    """

    scorer: str
    truth: Mapping[str, str]
    cells: str
    tables: Mapping[str, str]
    unsteady: tuple[str, ...] = ()
    page: str = ""
    own: str = ""
    metrics: tuple[str, ...] = ()
    ended: Ended | None = None

    @property
    def by(self) -> str:
        """The code that made the scores, written as the function `by` writes it."""
        return "+".join(filter(None, (self.scorer, self.own)))

    @classmethod
    def now(
        cls,
        plan: Plan,
        store: Store,
        scenes: Mapping[str, Scene],
        outcomes: Mapping[str, Outcome],
        metrics: tuple[str, ...] = (),
    ) -> "Made":
        """The facts about tables that are made now from these outcomes; their files already lie in the run folder."""
        known = facts_of(scenes)
        truth = {cell.scene: known[cell.scene].truth_digest for cell in plan.cells}
        tables = {name: _sha256(store.folder / name) for name in TABLES}
        return cls(digest(), truth, _cells(plan, store, outcomes), tables, own=own_digest(), metrics=metrics)

    def write(self, store: Store) -> None:
        """Write it into the run folder, beside the tables."""
        write_text(store.folder / FILE, json.dumps(asdict(self), indent=1))


def page_digest(store: Store, facts: Any) -> str:
    """Digest of a run's page, of the code that draws pages, and of `facts`; empty if there is no page.

    Parameters
    ----------
    facts
        What else the page is made from, as plain values.
    """
    return plans.digest([_sha256(store.folder / PAGE), _drawing(), facts]) if (store.folder / PAGE).exists() else ""


@cache
def _drawing() -> str:
    """Digest of all code and templates that may change a page."""
    # bytes of whole folders: drawing a page once too often costs little, showing a stale one would mislead
    here = Path(__file__).parents[1]
    files = [file for folder in _DRAWING for file in sorted((here / folder).rglob("*")) if file.suffix in _SOURCES]
    return plans.digest([sha256(file.read_bytes()).hexdigest() for file in files])


def made(store: Store) -> Made | None:
    """How the tables of a run were made; None if the file that says so is missing or damaged."""
    try:
        return _json.structure(read_json(store.folder / FILE, most=_MOST_BYTES), Made)
    except Exception:  # whatever a damaged one raises
        return None


def fault(plan: Plan, store: Store, outcomes: Mapping[str, Outcome | None] | None = None) -> str:
    """Why the tables of a run cannot be relied on, in words; empty if they can.

    Parameters
    ----------
    outcomes
        Key -> outcome of every cell of the plan, if the caller has read them.
    """
    found = made(store)
    if found is None:
        return "nothing says how they were made"
    if found.scorer != digest():
        return f"they were made by another scorer ({found.scorer}, not {digest()})"
    if any(_sha256(store.folder / name) != found.tables.get(name, "") for name in TABLES):
        return "they are not as they were written"
    # without reading maps: outcomes hold their digests
    outcomes = outcomes or {cell.key: store.outcome(cell) for cell in plan.cells}
    known = {key: outcome for key, outcome in outcomes.items() if outcome is not None}
    if found.cells != _cells(plan, store, known):
        return "cells were computed since"
    return ""


def stale(folder: Path, why: str) -> str:
    """What is wrong with the tables of a run, and what to type; `why` as `fault` says it."""
    return f"the tables of {str(folder)!r} are stale, {why}: type {renewal(folder)}"


def renewal(folder: Path) -> str:
    """The command that makes the tables of a run anew: in a new folder, if this user may not write into the run's."""
    return f"matbench score {shlex.quote(str(folder))}" + ("" if is_writable(folder) else " --out NEW")


def _cells(plan: Plan, store: Store, outcomes: Mapping[str, Outcome]) -> str:
    # outcomes hold no digest of volumes: the size tells at least whether one was kept
    told = [(key, _json.unstructure(o), _size(store, key) if o.has_volume else 0) for key, o in outcomes.items()]
    named = sorted((cell.key, *cell.method.names) for cell in plan.cells)  # labels stand in the tables
    return plans.digest([sorted(told, key=itemgetter(0)), named])


def _size(store: Store, key: str) -> int:
    """Bytes of a cell's volume, which has no digest; 0 if none was kept."""
    try:
        return (store.folder / "cells" / key / "volume.npz").stat().st_size
    except OSError:
        return 0


def _sha256(path: Path) -> str:
    """Digest of a table or page; empty if there is none; another text for what cannot be one."""
    try:
        return digest_plain(path, most=LARGEST)
    except NotPlain:
        return "no table"
    except FileNotFoundError:
        return ""
