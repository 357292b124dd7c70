"""`matbench view`: open recordings."""

from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from matbench.commands.console import DONE
from matbench.errors import UserError

app = App(name="view", help_epilogue="", help_format="markdown")


@app.default
def view(
    run: Path,
    cell: str | None = None,
    *,
    compare: Annotated[
        tuple[str, str] | None,
        Parameter(negative="", help="Two cells of one scene, side by side: parts of their names or keys."),
    ] = None,
    web: Annotated[bool, Parameter(negative="", help="In the browser instead of a window.")] = False,
) -> int:
    """Open the recording of a cell, or those of two cells side by side.

    **Examples**

    `matbench view runs/1a2b3c4d`

    `matbench view runs/1a2b3c4d 'materiality on synthetic/box' --web`

    `matbench view runs/1a2b3c4d --compare 'materiality on synthetic/box' 'multiview_sgm on synthetic/box'`

    Parameters
    ----------
    run
        Run folder that was written with `compare --record`, or a recording, such as of `scene show --record`.
    cell
        Part of the cell's name or key; not needed where there is only one recording.
    """
    from matbench.recording import viewer
    from matbench.runs.store import Store

    if compare is None:
        viewer.view(run if run.suffix == ".rrd" else Store(run).recording(cell), web)
        return DONE
    if run.suffix == ".rrd" or cell is not None:
        raise UserError("--compare takes two cells of a run: matbench view RUN --compare A B")
    from matbench.files.temporary import temporary_folder
    from matbench.recording import side_by_side

    one, other = (Store(run).recording(part) for part in compare)
    with temporary_folder() as folder:
        path = folder / "compare.rrd"
        side_by_side.merge(path, one, other)
        viewer.view(path, web)
    return DONE
