"""`matbench score`: make the tables of a run, or of several, again from the stored maps."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import pandas as pd
from attrs import evolve
from cyclopts import App, Parameter

from matbench.commands import growing, running
from matbench.commands.console import DONE, FAILED, Console
from matbench.commands.options import Data, Metrics, MetricSet, Plugins, asked_metrics
from matbench.errors import UserError
from matbench.files.csv_tables import most_bytes, read_csv
from matbench.files.temporary import temporary_folder
from matbench.files.writing import is_writable
from matbench.plans.plugins import using
from matbench.rescoring import join, mirror, open_run
from matbench.results import archive, freshness
from matbench.runs.lock import locked
from matbench.runs.store import Store
from matbench.spec import split_label

app = App(
    name="score",
    help="Score stored maps again: no method runs.",
    help_epilogue="""\
**Examples**

`matbench score runs/1a2b3c4d`  after a new metric, or a change of the scorer

`matbench score table3.zip`  check an exported run: are its scores what its maps give?

`matbench score runs/mine runs/theirs --out runs/both`  one table of two runs

`matbench score runs/now 'runs/old as before' --out runs/both`  the same where the code has changed between them
""",
    help_format="markdown",
)


@app.default
def score(
    run: Annotated[list[str], Parameter(negative="")],
    /,
    *,
    data: Data = None,
    plugin: Plugins = [],  # noqa: B006 -- never changed
    out: Annotated[
        Path | None,
        Parameter(help="New run folder, for several runs, an archive, or a run that is read-only."),
    ] = None,
    partial: Annotated[
        bool,
        Parameter(
            negative="", help="Leave out scenes that are missing or have changed, and metrics that nothing offers."
        ),
    ] = False,
    metric: Metrics = [],  # noqa: B006 -- never changed
    metrics: MetricSet = None,
) -> int:
    """Compute all scores from the stored maps; write tables and report anew, and say whether the scores changed.

    A run folder may come from anywhere: of its plug-in files only those are read that are given by --plugin.

    The scenes are needed. An archive is checked file by file, and not changed. The status is 1 if its scores
    are not what its maps give.

    The tables of a run folder that this user may not write are only printed; --out makes a new one of it.

    Parameters
    ----------
    run
        Run folder or exported archive; several are joined, where scenes are the same. `RUN as LABEL` gives the methods
        of a run that have other code there a label, so that they can stand in one table.
    """
    asked = asked_metrics(metric, metrics, plugin)
    console = Console()
    named = [(one, "") if os.path.exists(one) else split_label(one) for one in run]  # noqa: PTH110 (no path: False)
    runs = [Path(name) for name, _ in named]
    for name, _ in named:
        if not os.path.exists(name):  # noqa: PTH110
            raise UserError(f"{name!r} does not exist: give a run folder, or an archive made by matbench export")
    if len(run) > 1 and out is None:
        raise UserError(f"{len(run)} runs make a new one: name its folder by --out")
    if all(label for _, label in named):
        raise UserError(f"a label tells a run from others, and {', '.join(run)} has no other: give one without a label")
    if out is not None and out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise UserError(f"--out {str(out)!r} is there already: name a new folder")
    with temporary_folder() as aside:
        folders = [_folder(one, aside / f"{number}", console) for number, one in enumerate(runs)]
        labels = {folder: label for folder, (_, label) in zip(folders, named, strict=True) if label}
        claimed = None if len(runs) > 1 or runs[0].is_dir() else _claimed(folders[0])
        if out is not None and claimed is not None:
            out.parent.mkdir(parents=True, exist_ok=True)
            archive.unpack(runs[0], out)
            folders = [out]
        elif out is not None:
            folders = [join(folders, out, labels).folder]
        elif claimed is None and not is_writable(runs[0]):
            console.say(f"{runs[0]} is read-only: its tables are only printed; --out NEW keeps them in a new folder")
            with locked(runs[0]):
                beside = mirror(runs[0], Path(aside) / "tables" / runs[0].resolve().name)
                return _score(beside, data, plugin, partial, asked, console, None, say_paths=False)
        return _score(folders[0], data, plugin, partial, asked, console, claimed, say_paths=claimed is None)


def _folder(run: Path, aside: Path, console: Console) -> Path:
    """The folder of a run; an archive is unpacked into `aside` and checked."""
    if run.is_dir():
        return run
    archive.unpack(run, aside)
    console.say(f"{run}: every file is what it was when the run was exported")
    return aside


def _claimed(folder: Path) -> str:
    """The digest of the scorer that made an archive's tables, as the archive says."""
    made = freshness.made(Store(folder))
    return made.by if made else "an unknown one"


def _score(
    folder: Path,
    data: Path | None,
    plugin: Sequence[Path],
    partial: bool,
    metrics: Sequence[str],
    console: Console,
    claimed: str | None,
    say_paths: bool,
) -> int:
    ready, missing = open_run(folder, data, partial, plugin, metrics)
    for name, why in missing.items():
        console.say(f"without {name}: {why}")
    most = most_bytes(len(ready.plan.cells))
    before = _read(folder / "results.csv", most)
    known = freshness.made(ready.store)
    with locked(folder):
        voice = running.Voice(console, quiet=False, as_json=False)
        with voice.busy("scoring"):
            scored = ready.tables()
        decision = growing.decided_again(ready, scored, known.ended if known else None)
        if decision is not None:
            ready = evolve(ready, decision=str(decision))
        running.publish(ready, (folder / "ablation.csv").exists(), voice, say_paths=say_paths, scored=scored)
        if decision is not None:
            growing.remember(ready, decision)
    after = _read(folder / "results.csv", most)
    if before is None or after is None:
        return DONE
    added = sorted(set(after["metric"]) - set(before["metric"])) if metrics else []
    if added:
        console.say(f"metrics that were not there before: {', '.join(added)}")
    changed = _changes(before, after[~after["metric"].isin(added)])
    if not changed:
        console.say("the scores are what they were, byte for byte")
        return DONE
    console.say(f"{len(changed)} scores are not what they were:")
    for line in changed[:_SHOWN]:
        console.say(f"  {line}")
    if claimed is None:
        return DONE
    with using(plugin):
        here = freshness.by()
    if claimed != here:
        console.say(f"the archive's scores are by another scorer ({claimed}, here {here})")
    return FAILED


_SHOWN = 5
_KEYS = ("algorithm", "params", "scene", "view", "seed", "region", "metric")


def _read(path: Path, most: int) -> "pd.DataFrame | None":
    """A table with every value as text, to compare byte for byte; None if it is missing or unreadable."""
    try:
        return read_csv(path, [*_KEYS, "value"], most)
    except (OSError, ValueError):
        return None


def _changes(before: "pd.DataFrame", after: "pd.DataFrame") -> Sequence[str]:
    """The scores that differ, one line each."""
    old, new = (table.drop_duplicates(list(_KEYS)).set_index(list(_KEYS))["value"] for table in (before, after))
    both = pd.concat([old, new], axis=1, keys=["old", "new"]).fillna("not there")
    differ = both[both["old"] != both["new"]]
    return [f"{' '.join(filter(None, map(str, key)))}: {o} then, {n} now" for key, o, n in differ.itertuples()]
