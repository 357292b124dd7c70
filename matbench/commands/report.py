"""`matbench report`: the table of a finished run, for a paper."""

import sys
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import App, Parameter

from matbench.commands.console import DONE, Console
from matbench.commands.options import Plugins
from matbench.errors import UserError

app = App(
    name="report",
    help="Write the table of a finished run for a paper: LaTeX, Markdown or CSV.",
    help_epilogue="""\
It is made from `results.csv` and `cells.csv` of the run folder; no scene is needed and no method
runs. Without a format the tables are printed as `compare` prints them.

**Examples**

`matbench report runs/1a2b3c4d`

`matbench report runs/1a2b3c4d --format tex --out table.tex`

`matbench report runs/1a2b3c4d --format md -m bad_2 --region nonocc all`

`matbench report runs/1a2b3c4d --out means.csv --no-scenes`
""",
    help_format="markdown",
)


@app.default
def report(
    run: Path,
    *,
    format: Annotated[Literal["tex", "md", "csv"] | None, Parameter(help="Else that of --out's ending.")] = None,
    out: Annotated[Path | None, Parameter(name=["--out", "-o"], help="The file; else it is printed.")] = None,
    metric: Annotated[str, Parameter(name=["--metric", "-m"], help="What is shown.")] = "total_bad_1",
    region: Annotated[
        list[str] | None,
        Parameter(consume_multiple=True, negative="", help="Its columns; default the field's own five."),
    ] = None,
    scenes: Annotated[bool, Parameter(help="After the means, every scene.")] = True,
    plugin: Plugins = [],  # noqa: B006 -- never changed
) -> int:
    """Write methods x regions: means, mean ranks and every scene; best and second marked.

    Parameters
    ----------
    run
        Folder of a finished run.
    """
    from matbench.files.writing import write_text
    from matbench.plans.plugins import using
    from matbench.reports import paper, terminal
    from matbench.results import scores

    if format is None and out is not None:
        ending = out.suffix.lower().removeprefix(".")
        if ending not in paper.FORMATS:
            raise UserError(f"--out {str(out)!r} must end in .tex, .md or .csv, or name the --format")
        format = ending
    if out is not None and not out.parent.is_dir():
        raise UserError(f"folder {str(out.parent)!r} of --out does not exist")
    results, cells = paper.read_run(run)
    with using(plugin):
        known = {m.name: m.better for m in scores.metrics()}
    if metric not in known and (results["metric"] == metric).any():
        raise UserError(
            f"nothing offers {metric}, so nobody knows what is better: add --plugin with the file that has it"
        )
    better = known.get(metric, "lower")
    made = paper.sheet(results, cells, metric, better, region or (), scenes)
    console = Console()
    if format is None:
        for table in terminal.tables(results, cells, metric, better, console.width):
            console.print(table)
        return DONE
    text = paper.formatted(made, format)
    if out is None:
        sys.stdout.write(text)
    else:
        write_text(out, text)
        console.say(f"table: {out}")
    return DONE
