"""What `compare` and `ablate` share: run a comparison with progress, print its tables, write its report."""

import shlex
import signal
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from types import FrameType
from typing import Any

from attrs import frozen

from matbench.commands import json_document
from matbench.commands.console import DONE, FAILED, INTERRUPTED, Console, complain, print_json, print_text
from matbench.commands.options import Options
from matbench.commands.progress import Progress
from matbench.commands.streams import spare_output
from matbench.plans.limits import crowded
from matbench.plans.plugins import using
from matbench.prepared import Comparison
from matbench.reports import changes, curves, published, tables, terminal
from matbench.reports import switches as effects
from matbench.results.freshness import PAGE
from matbench.results.metric_catalogue import better
from matbench.results.scores import Tables
from matbench.runs.lock import locked
from matbench.runs.outcome import FINAL
from matbench.runs.stopped import Stopped
from matbench.runs.todo import Todo, explained
from matbench.scenes.catalogue import DATA_VARIABLE, data_root


@frozen
class Voice:
    """Where a command prints, and what.

    By default progress and tables. With ``--quiet`` only the run folder, and failed cells to the error stream.
    With ``--json`` one document at the end, and progress to the error stream.

    Parameters
    ----------
    talk
        The console for progress and remarks; None for none.
    quiet, as_json
        The options.
    """

    talk: Console | None
    quiet: bool
    as_json: bool

    @classmethod
    def of(cls, options: Options) -> "Voice":
        talk = None if options.quiet else Console(stderr=options.as_json)
        return cls(talk, options.quiet, options.as_json)

    def say(self, line: str) -> None:
        """Print a remark, unless ``--quiet`` was given."""
        if self.talk is not None:
            self.talk.say(line)

    def busy(self, what: str) -> AbstractContextManager[object]:
        """A context that shows, in a terminal, what is being done."""
        return nullcontext() if self.talk is None or not self.talk.is_interactive else self.talk.busy(what)


def work(ready: Comparison, options: Options, is_ablation: bool = False) -> int:
    """Run, print and report a comparison; the exit status."""
    voice = Voice.of(options)
    say_remarks(ready, voice)
    with locked(ready.folder), told_to_end() as write_undisturbed:
        try:
            todo = ready.pending()
            stopped = run(ready, todo, voice)
            write_undisturbed()
            kept = ready.kept(todo, is_ablation)
            cells = publish(ready, is_ablation, voice, stopped, kept)
        except (Stopped, OSError) as error:
            return stopped_by(error, ready)
    if stopped:
        voice.say("interrupted: the same command goes on from here")
        return INTERRUPTED
    return DONE if cells["status"].isin(FINAL).all() else FAILED


def stopped_by(error: Stopped | OSError, ready: Comparison) -> int:
    """Say what stops a run; an OSError comes where cells were written, but the disk has no room for the tables."""
    complain(f"stopped: {error if isinstance(error, Stopped) else Stopped.of(ready.folder, error)}")
    return FAILED


def say_remarks(ready: Comparison, voice: Voice) -> None:
    """Print what a reader must know before the run."""
    if (earlier := ready.settings.against) is not None:
        for name in ready.shared_with(earlier).others:
            voice.say(f"{name}: {str(earlier)!r} has it not, or as another scene")
    for reason, scenes in ready.left_out.items():
        voice.say(f"without {', '.join(scenes)}: {reason}")
    for remark in ready.remarks:
        voice.say(remark)
    if ready.settings.dask is None and (crowd := crowded(ready.settings.jobs, ready.settings.threads_each())):
        voice.say(crowd)


def show_plan(ready: Comparison, options: Options) -> int:
    """Print which cells would run, and why; nothing is written."""
    todo = explained(ready.plan, ready.store, ready.settings)
    total, stale = len(ready.plan.cells), len(ready.store.stale(ready.plan))
    if options.as_json:
        facts = {
            "folder": str(ready.folder),
            "cells": total,
            "todo": [{"cell": str(cell), "key": cell.key, "reason": why} for cell, why in todo],
            "stale": stale,
            "left_out": {reason: list(scenes) for reason, scenes in ready.left_out.items()},
        }
        print_json(facts)
        return DONE
    if options.quiet:
        print_text(str(ready.folder))
        return DONE
    console = Console()
    for reason, scenes in ready.left_out.items():
        console.say(f"without {', '.join(scenes)}: {reason}")
    for remark in ready.remarks:
        console.say(remark)
    console.say(f"{total - len(todo)} of {total} cells stay as they are in {ready.folder}, {len(todo)} would run")
    for cell, why in todo:
        console.say(f"  {cell}: {why}")
    if stale:
        console.say(f"{stale} stored cells are of other code or pixels")
    return DONE


def publish(
    ready: Comparison,
    is_ablation: bool,
    voice: Voice,
    stopped: bool = False,
    kept: Tables | None = None,
    say_paths: bool = True,
    scored: Tables | None = None,
    more: Mapping[str, Any] | None = None,
) -> Any:
    """Score the run, write and print its tables, write its report; returns the table of cells.

    Parameters
    ----------
    kept
        Tables that lie there with their page, and are what would be written (`Comparison.kept`).
    scored
        Tables that lie there, but whose page is still to be drawn.
    more
        What else the document of ``--json`` holds.
    """
    with using(ready.files):
        return _publish(ready, is_ablation, voice, stopped, kept, say_paths, scored, more or {})


def _publish(
    ready: Comparison,
    is_ablation: bool,
    voice: Voice,
    stopped: bool,
    kept: Tables | None,
    say_paths: bool,
    scored: Tables | None,
    more: Mapping[str, Any],
) -> Any:
    with voice.busy("scoring"):
        found = kept or scored or ready.tables()
        results, cells = found.results, found.cells
        sweeps = ready.sweeps(results)
        switches = ready.ablation(results) if is_ablation else None
    report = ready.folder / PAGE
    if kept is None:
        with voice.busy("drawing the report"):
            report = ready.report(found, switches, sweeps)
    written = {"scores": ready.folder / "results.csv", "report": report}
    if sweeps:
        written["curves"] = ready.folder / "sweeps.csv"
    if is_ablation:
        written["ablation"] = ready.folder / "ablation.csv"
    shown = _measured(results, ready, voice)
    against = ready.settings.against
    changed = None if against is None else ready.changes(results, against)
    if changed is not None:
        written["changes"] = ready.folder / "changes.csv"
    if voice.as_json:
        since = {} if changed is None else {"against": json_document.since(against, changed[1])}
        print_json({**json_document.document(ready, results, cells, shown, written, stopped), **since, **more})
    elif voice.talk is None:
        _say_failed(cells)
        print_text(str(ready.folder))
    else:
        spare_output()
        if len(shown) > 1 and not ready.settings.metrics:
            voice.say("shown is what the scenes' benchmark reports: -m or --metrics shows something else")
        _print_tables(results, cells, switches, sweeps, shown, voice.talk)
        if changed is not None:
            for name in shown:
                for table in changes.terminal(changed[0], changed[1], name, better(name), str(against)):
                    voice.talk.print(table)
        if (beside := ready.page.beside(found)) is not None:
            for table in published.terminal(beside):
                voice.talk.print(table)
        if results.empty:
            voice.say(tables.none_scored(cells))
        for line in found.unsteady:
            voice.say(f"does not repeat itself: {line}")
        doubtful = sum(outcome.is_doubtful for outcome in found.outcomes.values())
        if ready.settings.steady and doubtful:
            voice.say(f"{doubtful} cells are still in doubt, others took processors again: the same command retries")
        if say_paths:
            _say_paths(ready, written, voice)
    return cells


def _say_paths(ready: Comparison, written: dict[str, Path], voice: Voice) -> None:
    for what, path in written.items():
        voice.say(f"{what}: {path}")
    if any(ready.folder.glob("cells/*/recording.rrd")):
        voice.say(f"recordings: matbench view {shlex.quote(str(ready.folder))}")
    if stale := len(ready.store.stale(ready.plan)):
        prune = shlex.join(["matbench", "status", str(ready.folder), "--prune"])
        voice.say(f"{stale} stored cells are of other code or pixels: {prune} removes them")


def _say_failed(cells: Any) -> None:
    bad = tables.labelled(cells).fillna({"reason": ""})
    for _, row in bad[~bad["status"].isin(FINAL)].iterrows():
        complain(f"{row['status']}: {row['method']} on {row['scene']}: {row['reason']}")


def say_missing(missing: Sequence[str], options: Options) -> None:
    """Print which default scenes are missing, and how to get them."""
    if missing:
        data = options.data
        root = data_root(data)
        why = f"not under {root}" if root else f"give the folder of real scenes by --data or {DATA_VARIABLE}, or"
        place = f" --data {shlex.quote(str(data))}" if data else ""
        Voice.of(options).say(
            f"without {', '.join(missing)}: {why}{':' if root else ''} bring them with matbench fetch paper{place}"
        )


def run(ready: Comparison, todo: Todo, voice: Voice) -> bool:
    """Run a comparison and show progress; True if it was interrupted."""
    total, left = len(ready.plan.cells), len(todo.cells)
    if left < total:
        what = "are done already" if ready.settings.only is None else "stay as they are"
        voice.say(f"{total - left} of {total} cells {what} in {ready.folder}")
    try:
        with Progress(voice.talk, todo.cells, done=total - left) as progress:
            ready.run(progress, todo)
    except KeyboardInterrupt:
        return True
    return False


@contextmanager
def told_to_end() -> Iterator[Callable[[], None]]:
    """Treat SIGTERM and SIGHUP as Ctrl-C in this block, once; yields a function from whose call on they are ignored.

    Batch systems end jobs with the first, and a terminal that is closed sends the second. The running cells are then
    ended, and the tables are written, all the same. Whoever ignores SIGHUP, as nohup does, is heeded.
    """
    numbers = [signal.SIGTERM, *([signal.SIGHUP] if signal.getsignal(signal.SIGHUP) is signal.SIG_DFL else [])]

    def ignore() -> None:
        for number in numbers:
            signal.signal(number, signal.SIG_IGN)

    def end(number: int, frame: FrameType | None) -> None:
        ignore()  # a shell that is closed sends one more
        signal.default_int_handler(number, frame)

    before = {number: signal.signal(number, end) for number in numbers}
    try:
        yield ignore
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _measured(results: Any, ready: Comparison, voice: Voice) -> tuple[str, ...]:
    """The metrics to print: those asked for; if none was measured, as on scenes without truth, one that was."""
    measured = list(dict.fromkeys(results["metric"]))
    found = tuple(name for name in ready.metrics if name in measured)
    lacking = ", ".join(name for name in ready.metrics if name not in measured)
    if not measured or not lacking:
        return ready.metrics
    shown = found or tuple(name for name in (tables.METRIC, "prediction_psnr", *measured) if name in measured)[:1]
    if ready.settings.metrics:  # else scenes without truth have predictions only, and nobody asked for more
        were = "was" if len(ready.metrics) == len(found) + 1 else "were"
        voice.say(
            f"{lacking} {were} not measured, shown is {', '.join(shown)}: predictions need [predict=left] or "
            "[predict=right] after the scene, all others true disparities; those of volumes and of confidence also "
            "need a method that gives one"
        )
    return shown


def _print_tables(
    results: Any, cells: Any, switches: Any, sweeps: Any, metrics: Sequence[str], console: Console
) -> None:
    metric, others = metrics[0], {name: better(name) for name in metrics[1:]}
    for table in terminal.tables(results, cells, metric, better(metric), console.width, others):
        console.print(table)
    for table in curves.terminal(sweeps, metric):
        console.print(table)
    if switches is not None:
        for table in effects.terminal(switches, metric):
            console.print(table)
