"""What `compare` and `ablate` share: a comparison run with progress shown, its tables printed, its report written."""

import shlex
import signal
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from matbench import scoring
from matbench.cli import DONE, FAILED, INTERRUPTED, Console
from matbench.comparison import Comparison
from matbench.limits import crowded
from matbench.lock import locked
from matbench.repeats import unsteady
from matbench.reports import curves, tables
from matbench.reports import switches as effects
from matbench.scenes import DATA_VARIABLE, data_root
from matbench.store import FolderLost
from matbench.todo import explained, pending


def work(ready: Comparison, metric: str, is_ablation: bool = False) -> int:
    """Run, print and report a comparison; the exit status."""
    console = Console()
    for reason, scenes in ready.left_out.items():
        console.say(f"without {', '.join(scenes)}: {reason}")
    if ready.settings.dask is None and (crowd := crowded(ready.settings.jobs, ready.settings.threads_each())):
        console.say(crowd)
    with locked(ready.folder):
        try:
            stopped = _run(ready, console)
            cells = publish(ready, metric, is_ablation, console)
        except FolderLost as error:
            console.say(f"stopped: {error}")
            return FAILED
        except OSError as error:  # the tables are what does not fit any more
            console.say(f"stopped: {FolderLost.of(ready.folder, error)}")
            return FAILED
    if stopped:
        console.say("interrupted: the same command goes on from here")
        return INTERRUPTED
    return DONE if cells["status"].isin(["ok", "skipped"]).all() else FAILED


def show_plan(ready: Comparison) -> int:
    """Say what a run would do, and why; nothing is written."""
    console = Console()
    for reason, scenes in ready.left_out.items():
        console.say(f"without {', '.join(scenes)}: {reason}")
    todo = explained(ready.plan, ready.store, ready.settings)
    total = len(ready.plan.cells)
    console.say(f"{total - len(todo)} of {total} cells stay as they are in {ready.folder}, {len(todo)} would run")
    for cell, why in todo:
        console.say(f"  {cell}: {why}")
    if stale := len(ready.store.stale(ready.plan)):
        console.say(f"{stale} stored cells are of other code or pixels")
    return DONE


def publish(ready: Comparison, metric: str, is_ablation: bool, console: Console, say_paths: bool = True) -> Any:
    """Score, write and print tables and report; the table of cells."""
    results, cells = ready.tables()
    sweeps = ready.sweeps(results)
    switches = ready.ablation(results) if is_ablation else None
    report = ready.report(results, cells, switches, sweeps)
    _print_tables(results, cells, switches, sweeps, metric, console)
    for line in unsteady(ready.plan, ready.store):
        console.say(f"does not repeat itself: {line}")
    if not say_paths:
        return cells
    written = {"scores": ready.folder / "results.csv", "report": report}
    if sweeps:
        written["curves"] = ready.folder / "sweeps.csv"
    if is_ablation:
        written["ablation"] = ready.folder / "ablation.csv"
    for what, path in written.items():
        console.say(f"{what}: {path}")
    if any(ready.folder.glob("cells/*/recording.rrd")):
        console.say(f"recordings: matbench view {ready.folder}")
    if stale := len(ready.store.stale(ready.plan)):
        console.say(
            f"{stale} stored cells are of other code or pixels: matbench status {ready.folder} --prune removes them"
        )
    return cells


def say_missing(missing: Sequence[str], data: Path | None) -> None:
    if missing:
        root = data_root(data)
        why = f"not under {root}" if root else f"give the folder of real scenes by --data or {DATA_VARIABLE}, or"
        place = f" --data {shlex.quote(str(data))}" if data else ""
        print(f"without {', '.join(missing)}: {why}{':' if root else ''} bring them with matbench fetch paper{place}")


def _run(ready: Comparison, console: Console) -> bool:
    """Run a comparison with progress shown; True if it was interrupted."""
    todo = len(pending(ready.plan, ready.store, ready.settings))
    total = len(ready.plan.cells)
    if todo < total:
        what = "are done already" if ready.settings.only is None else "stay as they are"
        console.say(f"{total - todo} of {total} cells {what} in {ready.folder}")
    columns = (BarColumn(24), MofNCompleteColumn(), TimeElapsedColumn(), TextColumn("{task.description}"))
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("starting", total=total, completed=total - todo)

        def listen(event: str, cell: Any, outcome: Any) -> None:
            if event == "start":
                progress.update(task, description=escape(str(cell)))
                return
            progress.advance(task)
            took = f" {outcome.seconds:.2f} s" if outcome.seconds is not None else ""
            took += f" {outcome.reason}" if outcome.reason else ""
            if not console.is_terminal or outcome.reason:
                line = f"{outcome.status:>7}  {cell}{took}"
                console.say(line)

        # told to end, it ends its processes as if Ctrl-C had been typed
        before = signal.signal(signal.SIGTERM, signal.default_int_handler)
        try:
            ready.run(listen)
        except KeyboardInterrupt:
            return True
        finally:
            signal.signal(signal.SIGTERM, before)
    return False


def _print_tables(results: Any, cells: Any, switches: Any, sweeps: Any, metric: str, console: Console) -> None:
    measured = list(dict.fromkeys(results["metric"]))
    if measured and metric not in measured:
        shown = "prediction_psnr" if "prediction_psnr" in measured else measured[0]
        if metric != tables.METRIC:  # scenes without truth have predictions only
            console.say(
                f"{metric} was not measured, shown is {shown}: predictions need [predict=left] or [predict=right] "
                "after the scene, and metrics of volumes a method that has one"
            )
        metric = shown
    higher = next(m.better for m in scoring.metrics() if m.name == metric) == "higher"
    for table in tables.terminal(results, cells, metric, higher, console.width):
        console.print(table)
    for table in curves.terminal(sweeps, metric):
        console.print(table)
    if switches is not None:
        for table in effects.terminal(switches, metric):
            console.print(table)
