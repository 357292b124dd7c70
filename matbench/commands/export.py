"""`matbench export`: a run as one file."""

import shlex
from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from matbench.commands.console import DONE, Console
from matbench.results.archive import export as write_archive

app = App(
    name="export",
    help="Make one archive of a run: all that is needed to check its tables.",
    help_epilogue="""\
**Examples**

`matbench export runs/1a2b3c4d`  writes runs/1a2b3c4d.zip

`matbench export runs/1a2b3c4d --out table3.zip`

`matbench score table3.zip`  checks it, anywhere
""",
    help_format="markdown",
)


@app.default
def export(
    run: Path,
    /,
    *,
    out: Annotated[Path | None, Parameter(help="The archive; default beside the run folder, else here.")] = None,
) -> int:
    """Write plan, maps, tables, report and a digest of each into one archive; the same run gives the same bytes.

    Scenes, recordings and the methods' code are not in it, only their digests.

    Parameters
    ----------
    run
        Run folder.
    """
    console = Console()
    place, left = write_archive(run, out)
    if left:
        console.say(f"{left} cells of the plan are not done, and so not in the archive")
    console.say(f"archive: {place}")
    console.say(f"to check it: matbench score {shlex.quote(str(place))}")
    return DONE
