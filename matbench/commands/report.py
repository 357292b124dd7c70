"""`matbench report`: the table of a finished run, for a paper."""

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import App, Parameter

from matbench.commands.console import DONE, Console, complain, print_text
from matbench.commands.options import Metrics, MetricSet, Plugins
from matbench.errors import UserError

if TYPE_CHECKING:
    from collections.abc import Sequence

    import pandas as pd

    from matbench.measures.metrics import Better

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

`matbench report runs/1a2b3c4d --published`  scores as published, in grey, beside those of the same protocol
""",
    help_format="markdown",
)


@app.default
def report(
    run: Path,
    *,
    format: Annotated[Literal["tex", "md", "csv"] | None, Parameter(help="Else that of --out's ending.")] = None,
    out: Annotated[Path | None, Parameter(name=["--out", "-o"], help="The file; else it is printed.")] = None,
    metric: Metrics = [],  # noqa: B006 -- never changed
    metrics: MetricSet = None,
    region: Annotated[
        list[str] | None,
        Parameter(consume_multiple=True, negative="", help="Its columns; default the field's own five."),
    ] = None,
    scenes: Annotated[bool, Parameter(help="After the means, every scene.")] = True,
    published: Annotated[
        bool, Parameter(negative="", help="Then scores as published, beside scenes of the very same views and range.")
    ] = False,
    plugin: Plugins = [],  # noqa: B006 -- never changed
) -> int:
    """Write methods x regions: means, mean ranks and every scene; best and second marked.

    Parameters
    ----------
    run
        Folder of a finished run.
    """
    from matbench.files.writing import write_text
    from matbench.measures.benchmarks import set_named
    from matbench.reports import paper, run_tables, terminal
    from matbench.reports import published as as_published
    from matbench.reports.tables import METRIC

    if format is None and out is not None:
        ending = out.suffix.lower().removeprefix(".")
        if ending not in paper.FORMATS:
            raise UserError(f"--out {str(out)!r} must end in .tex, .md or .csv, or name the --format")
        format = ending
    if out is not None and not out.parent.is_dir():
        raise UserError(f"folder {str(out.parent)!r} of --out does not exist")
    results, cells = run_tables.read_run(run)
    if said := run_tables.doubt(run):
        complain(said)
    names = [*metric, *(set_named(metrics).metrics if metrics is not None else ())] or [METRIC]
    known = dict(_judged(name, results, run, plugin) for name in names)
    made = [paper.sheet(results, cells, name, better, region or (), scenes) for name, better in known.items()]
    first, *others = known
    beside = as_published.beside(results, cells, first) if published else None
    console = Console()
    if format is None:
        rest = {name: known[name] for name in others}
        for table in terminal.tables(results, cells, first, known[first], console.width, rest):
            console.print(table)
        for table in as_published.terminal(beside) if beside else ():
            console.print(table)
        return DONE
    text = paper.together(made, format)
    if beside is not None:
        text = as_published.appended(text, beside, format)
    if out is None:
        print_text(text.removesuffix("\n"))
    else:
        write_text(out, text)
        console.say(f"table: {out}")
    return DONE


def _judged(name: str, results: "pd.DataFrame", run: Path, plugin: "Sequence[Path]") -> "tuple[str, Better]":
    """The name of a metric as tables have it, and which direction of it is better.

    Raises
    ------
    UserError
        If nothing offers it, or the run has it not.
    """
    from matbench.errors import unknown
    from matbench.plans.plugins import using
    from matbench.reports.tables import metrics
    from matbench.results import metric_catalogue

    measured = metrics(results)
    with using(plugin):
        try:
            found = metric_catalogue.metric_named(name)
        except UserError:
            if name not in measured:
                raise unknown("metric of this run", name, measured) from None
            raise UserError(
                f"nothing offers {name}, so nobody knows what is better: add --plugin with the file that has it"
            ) from None
    if len(results) and found.name not in measured:
        score = shlex.join(["matbench", "score", str(run), "-m", found.name])
        raise UserError(f"{str(run)!r} was not scored by {found.name}: type {score} first")
    return found.name, found.better
