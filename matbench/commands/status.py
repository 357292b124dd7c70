"""`matbench status`: where a run stands."""

from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from matbench.commands.console import DONE, Console, print_json
from matbench.commands.progress import duration
from matbench.results.freshness import renewal
from matbench.results.status import Standing, prune, standing

app = App(
    name="status",
    help="Show where a run stands, also while it runs.",
    help_epilogue="""\
**Examples**

`matbench status runs/1a2b3c4d`

`watch matbench status runs/1a2b3c4d`  while it runs in another terminal

`matbench status runs/1a2b3c4d --json`

`matbench status runs/1a2b3c4d --prune`  remove what earlier code left
""",
    help_format="markdown",
)


@app.default
def status(
    run: Path,
    /,
    *,
    as_json: Annotated[bool, Parameter(name="--json", negative="", help="Machine-readable.")] = False,
    remove: Annotated[
        bool,
        Parameter(name="--prune", negative="", help="Remove stored cells of code or pixels that have changed since."),
    ] = False,
) -> int:
    """Show what is done, what failed, what runs and what is left of a run.

    Parameters
    ----------
    run
        Run folder.
    """
    removed = prune(run) if remove else 0
    found = standing(run)
    if as_json:
        print_json(_json(found))
        return DONE
    console = Console()
    if removed:
        console.say(f"{removed} stored cells of other code or pixels removed")
    for line in _lines(found):
        console.say(line)
    return DONE


def _lines(found: Standing) -> list[str]:
    done = sum(found.counts.values()) - found.failed
    ended = ", ".join(f"{count} {status}" for status, count in found.counts.items()) or "none ended"
    lines = [f"{found.folder}: {done} of {found.cells} cells done, {found.left} left ({ended})"]
    if found.work:
        elapsed = duration(_age(found))
        lines.append(f"running for {elapsed}, process {found.work.pid} on {found.work.host}")
        lines += [f"  {cell}, for {duration(spent)}" for cell, spent in found.running]
    elif found.left:
        lines.append("not running: the command that began it goes on from here")
    if found.left:
        guess = "not known yet" if found.seconds_left is None else f"about {duration(found.seconds_left)}"
        lines.append(f"time left: {guess}")
    if found.stale:
        size = found.stale_bytes / 2**20
        lines.append(f"{found.stale} stored cells ({size:.1f} MiB) are of other code or pixels; --prune removes them")
    if found.tables and not found.work:
        lines.append(f"tables are stale, {found.tables}: type {renewal(found.folder)}")
    return lines


def _age(found: Standing) -> float:
    import time

    return max(0.0, time.time() - found.work.since) if found.work else 0.0


def _json(found: Standing) -> dict[str, object]:
    work = found.work and {"pid": found.work.pid, "host": found.work.host, "seconds": _age(found)}
    return {
        "cells": found.cells,
        "done": sum(found.counts.values()) - found.failed,
        "failed": found.failed,
        "left": found.left,
        "statuses": dict(found.counts),
        "process": work,
        "running": [{"cell": str(cell), "key": cell.key, "seconds": spent} for cell, spent in found.running],
        "seconds_left": found.seconds_left,
        "stale": found.stale,
        "stale_bytes": found.stale_bytes,
        "tables": found.tables or "current",
    }
