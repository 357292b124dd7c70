"""Which cells of a plan are left to compute, and why."""

from collections.abc import Mapping

from attrs import field, frozen

from matbench.plans.plan import Cell, Plan
from matbench.plans.settings import Settings
from matbench.runs.outcome import FINAL, Outcome
from matbench.runs.store import Store


@frozen(eq=False)
class Todo:
    """The cells that a run has to compute, found by reading every cell of its plan once.

    Parameters
    ----------
    cells
        The cells to compute, in the plan's order.
    outcomes
        Key -> outcome, for each cell that is stored whole.
    """

    cells: tuple[Cell, ...] = ()
    outcomes: Mapping[str, Outcome] = field(factory=dict)


def pending(plan: Plan, store: Store, settings: Settings) -> Todo:
    """The cells that a run has to compute.

    By default these are the cells without a final outcome, and those that lack a recording or a volume
    that was asked for. `Settings.only` takes fewer of them, or all cells. Every map is read: a cell whose
    map is damaged is computed again.
    """
    cells, outcomes = [], {}
    for cell in plan.cells:
        outcome = store.read(cell).outcome
        if outcome is not None:
            outcomes[cell.key] = outcome
        is_failed = outcome is not None and outcome.status not in FINAL
        is_missing = not is_failed and bool(_lacks(cell, outcome, store, settings))
        due = {"all": True, "failed": is_failed, "missing": is_missing, None: is_failed or is_missing}
        if due[settings.only]:
            cells.append(cell)
    return Todo(tuple(cells), outcomes)


def explained(plan: Plan, store: Store, settings: Settings) -> list[tuple[Cell, str]]:
    """The cells of `pending`, each with the reason in words."""
    before: dict[tuple[str, str, str, int, int], list[Cell]] = {}
    for old in store.stale(plan):
        before.setdefault(old.question, []).append(old)
    out = []
    todo = pending(plan, store, settings)
    for cell in todo.cells:
        outcome = todo.outcomes.get(cell.key)
        why = _reason(cell, outcome, store, settings)
        if outcome is None and cell.question in before:
            why = _changed(cell, before[cell.question])
        out.append((cell, why))
    return out


def _lacks(cell: Cell, outcome: Outcome | None, store: Store, settings: Settings) -> str:
    """What a cell lacks of what was asked for, in words; empty if it lacks nothing."""
    if outcome is None:
        return "its files are damaged" if store.cell(cell).exists() else "not computed yet"
    if settings.steady and outcome.is_doubtful:
        return f"its seconds are in doubt: {outcome.doubt or 'other cells ran meanwhile'}"
    if cell.repeat:  # it is solved only to compare its maps: neither a volume nor a recording is wanted of it
        return ""
    if settings.volumes and outcome.has_volume and store.volume(cell) is None:
        return "its volume was not kept"
    if settings.record is None or outcome.status != "ok":
        return ""
    if outcome.recorded is None or not (store.cell(cell) / "recording.rrd").exists():
        return "it has no recording"
    return "" if outcome.recorded.covers(settings.record) else "its recording holds less"


def _reason(cell: Cell, outcome: Outcome | None, store: Store, settings: Settings) -> str:
    if outcome is not None and outcome.status not in FINAL:
        return f"{outcome.status}: {outcome.reason}" if outcome.reason else outcome.status
    return _lacks(cell, outcome, store, settings) or "asked for again"


def _changed(cell: Cell, before: list[Cell]) -> str:
    """Why the stored cells that asked the same before do not count any more."""
    # with the same code and pixels, only `matbench.plans.plan.SCHEMA` can have made another key
    if any(old.scene_digest == cell.scene_digest and old.method.code == cell.method.code for old in before):
        return "stored by another version of matbench"
    if any(old.scene_digest == cell.scene_digest for old in before):
        return "code changed"
    if any(old.method.code == cell.method.code for old in before):
        return "scene changed"
    return "code and scene changed"
