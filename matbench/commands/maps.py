"""`matbench maps`: are ready-made maps found, and what they are taken for?"""

from math import inf, isfinite
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import App, Parameter

from matbench.commands.console import DONE, FAILED, Console
from matbench.commands.options import Data, Plugins, many
from matbench.errors import UserError

app = App(
    name="maps",
    help="Look at ready-made disparity maps before they are scored.",
    help_epilogue="""\
**Examples**

`matbench maps check results/raft -s paper`  which scenes have a map, and are they what they seem?

`matbench compare -a 'maps[folder=results/raft]' sgbm -s paper`  then score them beside other methods
""",
    help_format="markdown",
)


@app.command(help_epilogue="")
def check(
    folder: Path,
    *,
    scene: Annotated[list[str], many("-s", "--scene", "Scene or pattern, as for `compare`.")],
    pattern: Annotated[str, Parameter(help="What the files are called, such as {scene}_{view}.png.")] = "",
    unit: Annotated[Literal["pair", "step"], Parameter(help="Pixels between the field's pair, or per view step.")] = (
        "pair"
    ),
    scale: Annotated[float, Parameter(help="The stored number of one pixel.")] = 1.0,
    sign: Annotated[int, Parameter(help="-1 if what is nearer has the smaller number.")] = 1,
    unknown: Annotated[float | None, Parameter(help="The stored number of no answer.")] = None,
    data: Data = None,
    plugin: Plugins = [],  # noqa: B006 -- never changed
) -> int:
    """Say which scenes have a map in a folder, and whether it is upside down, scaled, or another view's.

    Each way in which a map may be meant otherwise is tried against the truth, and what is clearly better is said with
    the option that makes it so. Ends with status 1 if a map is missing or there is a problem.

    **Examples**

    `matbench maps check results/raft -s paper`

    `matbench maps check results/kitti -s 'kitti/*' --scale 256 --unknown 0`

    Parameters
    ----------
    folder
        With the maps, as for `maps[folder=...]`.
    """
    from matbench.files.maps import Reading
    from matbench.plans.plugins import using

    if not folder.is_dir():
        raise UserError(f"folder {str(folder)!r} does not exist: give the folder that holds the maps")
    if not 0 < scale < inf:
        raise UserError(
            f"--scale {scale:g} is not above 0 and finite: it is the stored number of one pixel, such as 256"
        )
    if unknown is not None and not isfinite(unknown):
        raise UserError(f"--unknown {unknown:g} is not finite: NaN and infinity are never answers, leave it out")
    if sign not in (1, -1):
        raise UserError(f"--sign {sign} is not 1 or -1")
    with using(plugin):
        return _check(folder, scene, pattern, Reading(scale, sign, unit, unknown), data)


def _check(folder: Path, scenes: list[str], pattern: str, reading: object, data: Path | None) -> int:
    from rich.text import Text

    from matbench.files.maps import Reading, read_map
    from matbench.scenes import maps_check
    from matbench.scenes.catalogue import load_scene, select
    from matbench.scenes.ready_maps import find
    from matbench.scenes.scene_check import Observation

    assert isinstance(reading, Reading)  # noqa: S101
    console, problems, found = Console(), 0, 0
    marks = {"good": ("✓", "green"), "note": ("•", "yellow"), "problem": ("✗", "bold red"), "unknown": ("?", "yellow")}
    names = select(scenes, data).names
    for name in names:
        with console.status(name):
            loaded = load_scene(name, data)
            try:
                files = find(folder, loaded, pattern)
                seen = maps_check.check(read_map(files[loaded.ref]), loaded, reading)
                found += 1
                told = f"{files[loaded.ref].relative_to(folder)}: {seen.text}"
                if len(files) > 1:
                    told += f" ({len(files)} views have a map)"
            except UserError as error:
                seen, told = Observation(name, "problem", ""), str(error)
        problems += seen.verdict == "problem"
        mark, style = marks[seen.verdict]
        console.print(Text.assemble((f"{mark} ", style), (f"{name}: ", "bold"), told), soft_wrap=True, highlight=False)
    console.say(f"{found} of {len(names)} scenes have a map; {problems or 'no'} problem{'' if problems == 1 else 's'}")
    return FAILED if problems else DONE
