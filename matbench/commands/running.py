"""What `compare` and `ablate` share: run a comparison with progress, print its tables, write its report."""

import json
import math
import shlex
import signal
import sys
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from typing import Any

from attrs import frozen

from matbench.commands.console import DONE, FAILED, INTERRUPTED, Console
from matbench.commands.options import Options
from matbench.commands.progress import Progress
from matbench.comparison import Comparison
from matbench.measures.metrics import Better
from matbench.plans.limits import crowded
from matbench.plans.plugins import using
from matbench.reports import costs, curves, tables, terminal
from matbench.reports import switches as effects
from matbench.results import scores
from matbench.results.freshness import PAGE
from matbench.results.scores import Tables
from matbench.runs.lock import locked
from matbench.runs.outcome import FINAL
from matbench.runs.store import FolderLost
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
        return nullcontext() if self.talk is None or not self.talk.is_terminal else self.talk.status(what)


def work(ready: Comparison, options: Options, is_ablation: bool = False) -> int:
    """Run, print and report a comparison; the exit status."""
    voice = Voice.of(options)
    for reason, scenes in ready.left_out.items():
        voice.say(f"without {', '.join(scenes)}: {reason}")
    for remark in ready.remarks:
        voice.say(remark)
    if ready.settings.dask is None and (crowd := crowded(ready.settings.jobs, ready.settings.threads_each())):
        voice.say(crowd)
    with locked(ready.folder), _ended_as_by_ctrl_c():
        try:
            todo = ready.pending()
            stopped = _run(ready, todo, voice)
            cells = publish(ready, options.metric, is_ablation, voice, stopped, ready.kept(todo, is_ablation))
        except FolderLost as error:
            print(f"matbench: stopped: {error}", file=sys.stderr)
            return FAILED
        except OSError as error:  # cells were written, but the disk has no room for the tables
            print(f"matbench: stopped: {FolderLost.of(ready.folder, error)}", file=sys.stderr)
            return FAILED
    if stopped:
        voice.say("interrupted: the same command goes on from here")
        return INTERRUPTED
    return DONE if cells["status"].isin(FINAL).all() else FAILED


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
        print(json.dumps(facts, indent=1))
        return DONE
    if options.quiet:
        print(ready.folder)
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
    metric: str,
    is_ablation: bool,
    voice: Voice,
    stopped: bool = False,
    kept: Tables | None = None,
    say_paths: bool = True,
) -> Any:
    """Score the run, write and print its tables, write its report; returns the table of cells.

    Parameters
    ----------
    kept
        Tables that lie there with their page, and are what would be written (`Comparison.kept`).
    """
    with using(ready.files):
        return _publish(ready, metric, is_ablation, voice, stopped, kept, say_paths)


def _publish(
    ready: Comparison,
    metric: str,
    is_ablation: bool,
    voice: Voice,
    stopped: bool,
    kept: Tables | None,
    say_paths: bool,
) -> Any:
    with voice.busy("scoring"):
        found = ready.tables() if kept is None else kept
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
    metric = _measured(results, metric, voice)
    if voice.as_json:
        print(json.dumps(document(ready, results, cells, metric, written, stopped), indent=1, allow_nan=False))
    elif voice.talk is None:
        _say_failed(cells)
        print(ready.folder)
    else:
        _print_tables(results, cells, switches, sweeps, metric, voice.talk)
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


def document(
    ready: Comparison, results: Any, cells: Any, metric: str, written: dict[str, Path], stopped: bool
) -> dict[str, Any]:
    """The document of `--json`: the run folder, the status of its cells, and the rows of the summary.

    Keys: ``folder``; ``files``, what was written; ``interrupted``; ``cells``, status -> how many; ``unscored``,
    each cell without a score with its reason; ``left_out``, why -> scenes; ``metric``; ``table``, the methods, best
    first, with their means over the scenes they share in ``regions``, ``avg`` (pixels of the pair, in `all`) and
    ``seconds``; null where there is no number. ``counted``: region -> how many scenes its means are over. Of each
    method also ``answered``: region -> per cent of the pixels that its mean is over; ``answers``: per cent of the
    pixels of `all` that it answers; ``seconds_ranked``: may its seconds be compared? and ``remark``: why it is not
    ranked, and what it leaves unanswered. ``clock``: whose seconds these are.
    """
    regions, scope = tables.summarised(results), tables.shared(results, cells)
    counted = {region: tables.count(tables.per_scene(results, region, metric), scope) for region in regions}
    answered = {region: tables.means(results, scope, region, metric, "answered") for region in regions}
    rows = [
        {
            "method": str(method),
            "ranked": bool(row["ranked"]),
            "scenes": int(row["scenes"]),
            "asked": int(row["asked"]),
            "regions": {region: _number(row[f"{metric} {region}"]) for region in regions},
            "avg": _number(row["avg all"]),
            "seconds": _number(row["seconds"]),
            "seconds_ranked": bool(row["alike"]),
            "answered": {region: _number(answered[region][str(method)]) for region in regions},
            "answers": _number(row["answers"]),
            "remark": str(row["remark"]),
        }
        for method, row in tables.summary(results, cells, metric, _better(metric)).iterrows()
    ]
    bad = tables.labelled(cells)
    bad = bad[bad["status"] != "ok"]
    columns = ["method", "scene", "seed", "status", "reason"]
    return {
        "folder": str(ready.folder),
        "files": {what: str(path) for what, path in written.items()},
        "interrupted": stopped,
        "cells": {str(status): int(count) for status, count in cells["status"].value_counts().items()},
        "unscored": [dict(zip(columns, map(_plain, row), strict=True)) for row in bad[columns].to_numpy().tolist()],
        "left_out": {reason: list(scenes) for reason, scenes in ready.left_out.items()},
        "metric": {"name": metric, "unit": tables.metrics(results).get(metric, ""), "better": _better(metric)},
        "counted": counted,
        "clock": costs.CLOCK,
        "table": rows,
    }


def _number(value: Any) -> float | None:
    return float(value) if math.isfinite(value) else None


def _plain(value: Any) -> Any:
    return "" if isinstance(value, float) and math.isnan(value) else value


def _better(metric: str) -> Better:
    return scores.metric_named(metric).better


def _say_failed(cells: Any) -> None:
    bad = tables.labelled(cells)
    for _, row in bad[~bad["status"].isin(FINAL)].iterrows():
        print(f"matbench: {row['status']}: {row['method']} on {row['scene']}: {_plain(row['reason'])}", file=sys.stderr)


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


def _run(ready: Comparison, todo: Todo, voice: Voice) -> bool:
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
def _ended_as_by_ctrl_c() -> Iterator[None]:
    """Treat SIGTERM as Ctrl-C in this block.

    Batch systems end jobs with it. The running cells are then ended, and the tables are written, all the same.
    """
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _measured(results: Any, metric: str, voice: Voice) -> str:
    """The metric to print: the one asked for; if it was not measured, as on scenes without truth, one that was."""
    measured = list(dict.fromkeys(results["metric"]))
    if not measured or metric in measured:
        return metric
    shown = "prediction_psnr" if "prediction_psnr" in measured else str(measured[0])
    if metric != tables.METRIC:  # scenes without truth have predictions only
        voice.say(
            f"{metric} was not measured, shown is {shown}: predictions need [predict=left] or [predict=right] "
            "after the scene, and metrics of volumes a method that has one"
        )
    return shown


def _print_tables(results: Any, cells: Any, switches: Any, sweeps: Any, metric: str, console: Console) -> None:
    for table in terminal.tables(results, cells, metric, _better(metric), console.width):
        console.print(table)
    for table in curves.terminal(sweeps, metric):
        console.print(table)
    if switches is not None:
        for table in effects.terminal(switches, metric):
            console.print(table)
