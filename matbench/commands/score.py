"""`matbench score`: make the tables of a run, or of several, again from the stored maps."""

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import pandas as pd
from cyclopts import App, Parameter

from matbench.commands import running
from matbench.commands.console import DONE, FAILED, Console
from matbench.commands.options import Data, Plugins, check_metric
from matbench.errors import UserError
from matbench.plans.plugins import using
from matbench.reports.tables import METRIC
from matbench.rescoring import join, open_run
from matbench.results import archive, freshness
from matbench.runs.lock import locked
from matbench.runs.store import Store

app = App(
    name="score",
    help="Score stored maps again: no method runs.",
    help_epilogue="""\
**Examples**

`matbench score runs/1a2b3c4d`  after a new metric, or a change of the scorer

`matbench score table3.zip`  check an exported run: are its scores what its maps give?

`matbench score runs/mine runs/theirs --out runs/both`  one table of two runs
""",
    help_format="markdown",
)


@app.default
def score(
    run: Annotated[list[Path], Parameter(negative="")],
    /,
    *,
    data: Data = None,
    plugin: Plugins = [],  # noqa: B006 -- never changed
    out: Annotated[
        Path | None, Parameter(help="New run folder for several runs, or for what an archive holds.")
    ] = None,
    partial: Annotated[
        bool,
        Parameter(
            negative="", help="Leave out scenes that are missing or have changed, and metrics that nothing offers."
        ),
    ] = False,
    metric: Annotated[str, Parameter(name=["--metric", "-m"], help="Metric of the printed tables.")] = METRIC,
) -> int:
    """Compute all scores from the stored maps; write tables and report anew, and say whether the scores changed.

    A run folder may come from anywhere: of its plug-in files only those are read that are given by --plugin.

    The scenes are needed. An archive is checked file by file, and not changed. The status is 1 if its scores
    are not what its maps give.

    Parameters
    ----------
    run
        Run folder or exported archive; several are joined, where scenes and code are the same.
    """
    check_metric(metric, plugin)
    console = Console()
    for one in run:
        if not one.exists():
            raise UserError(f"{str(one)!r} does not exist: give a run folder, or an archive made by matbench export")
    if len(run) > 1 and out is None:
        raise UserError(f"{len(run)} runs make a new one: name its folder by --out")
    if out is not None and len(run) == 1 and run[0].is_dir():
        raise UserError(
            f"--out {str(out)!r} is for archives and for several runs: {str(run[0])!r} is scored in its place"
        )
    if out is not None and out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise UserError(f"--out {str(out)!r} is there already: name a new folder")
    with tempfile.TemporaryDirectory(prefix="matbench-") as aside:
        folders = [_folder(one, Path(aside) / f"{number}", console) for number, one in enumerate(run)]
        if len(folders) > 1 and out is not None:
            return _score(join(folders, out).folder, data, plugin, partial, metric, console, None)
        claimed = None if run[0].is_dir() else _claimed(folders[0])
        if out is not None and claimed is not None:
            out.parent.mkdir(parents=True, exist_ok=True)
            archive.unpack(run[0], out)
            folders = [out]
        return _score(folders[0], data, plugin, partial, metric, console, claimed)


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
    metric: str,
    console: Console,
    claimed: str | None,
) -> int:
    ready, missing = open_run(folder, data, partial, plugin)
    for name, why in missing.items():
        console.say(f"without {name}: {why}")
    before = _read(folder / "results.csv")
    with locked(folder):
        voice = running.Voice(console, quiet=False, as_json=False)
        running.publish(ready, metric, (folder / "ablation.csv").exists(), voice, say_paths=claimed is None)
    changed = _changes(before, _read(folder / "results.csv"))
    if before is None:
        return DONE
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


def _read(path: Path) -> "pd.DataFrame | None":
    """A table with every value as text, to compare byte for byte; None if it is missing or unreadable."""
    try:
        table = pd.read_csv(path, dtype=str, keep_default_na=False)
    except (OSError, ValueError):
        return None
    return table if {*_KEYS, "value"} <= set(table.columns) else None


def _changes(before: "pd.DataFrame | None", after: "pd.DataFrame | None") -> Sequence[str]:
    """The scores that differ, one line each."""
    if before is None or after is None:
        return []
    old, new = (table.drop_duplicates(list(_KEYS)).set_index(list(_KEYS))["value"] for table in (before, after))
    both = pd.concat([old, new], axis=1, keys=["old", "new"]).fillna("not there")
    differ = both[both["old"] != both["new"]]
    return [f"{' '.join(filter(None, map(str, key)))}: {o} then, {n} now" for key, o, n in differ.itertuples()]
