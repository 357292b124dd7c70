"""`matbench scene`: look at scenes, check them, make one's own."""

import os
import re
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from matbench.commands.console import DONE, FAILED, Console
from matbench.commands.options import Data, Plugins
from matbench.errors import UserError

app = App(
    name="scene",
    help="Look at scenes, check them, and make your own.",
    help_epilogue="""\
**Examples**

`matbench scene show synthetic/curved`  a contact sheet: views, truth, regions

`matbench scene new my_scene`  write the scene.toml of a folder of images

`matbench scene check my_scene`  is it what it says?
""",
    help_format="markdown",
)


@app.command(help_epilogue="")
def show(
    *names: str,
    out: Annotated[
        Path | None, Parameter(name=["--out", "-o"], help="The PNG file; default scene-NAME.png in this folder.")
    ] = None,
    record: Annotated[bool, Parameter(negative="", help="Also write a recording beside it, for `view`.")] = False,
    data: Data = None,
    plugin: Plugins = [],  # noqa: B006 -- never changed
) -> int:
    """Draw a contact sheet of a scene: its views, one row in all of them, its truth, its regions.

    **Examples**

    `matbench scene show synthetic/curved`

    `matbench scene show 'middlebury2003/teddy[size=half]' -o teddy.png --data DATA`

    `matbench scene show my_scene --record`

    Parameters
    ----------
    names
        Scenes or patterns, as for `compare`; the path of a folder is a scene of your own.
    """
    from matbench.plans.plugins import using

    with using(plugin):
        return _show(names, out, record, data)


def _show(names: Sequence[str], out: Path | None, record: bool, data: Path | None) -> int:
    from matbench.files.writing import write_bytes
    from matbench.reports.contact_sheet import contact_sheet
    from matbench.scenes.catalogue import load_scene, select

    if not names:
        raise UserError("no scene: name one, such as 'matbench scene show synthetic/curved'")
    chosen = select(names, data, needs_truth=False)
    console = Console()
    for reason, scenes in chosen.left_out.items():
        console.say(f"without {', '.join(scenes)}: {reason}")
    if out is not None and len(chosen.names) > 1:
        raise UserError(
            f"--out {str(out)!r} is one file for {len(chosen.names)} scenes: name one scene, or leave it out"
        )
    if out is not None and out.suffix.lower() != ".png":
        raise UserError(f"--out {str(out)!r} must end in .png")
    for name in chosen.names:
        path = out or Path(f"scene-{_file_name(name)}.png")
        if not path.parent.is_dir():
            raise UserError(f"folder {str(path.parent)!r} of --out does not exist")
        with console.busy(f"{name}: reading"):
            scene = load_scene(name, data)
        with console.busy(f"{name}: drawing"):
            write_bytes(path, contact_sheet(scene))
        console.say(f"contact sheet: {path}")
        if record:
            from matbench.recording.rrd import record_scene

            with console.busy(f"{name}: recording"):
                record_scene(path.with_suffix(".rrd"), scene)
            console.say(f"recording: matbench view {shlex.quote(str(path.with_suffix('.rrd')))}")
    return DONE


def _file_name(scene: str) -> str:
    """``middlebury2003/teddy[size=half]`` -> ``middlebury2003-teddy-size-half``; a folder's last part."""
    from matbench.scenes.catalogue import own_folder
    from matbench.spec import parse

    spec = parse(scene)[0]
    folder = own_folder(spec.name)
    name = spec.name if folder is None else os.path.basename(os.path.abspath(folder))  # noqa: PTH100, PTH119
    told = " ".join([name, *(f"{key} {value}" for key, value in spec.options.items())])
    return re.sub(r"[^\w.+]+", "-", told).strip("-.") or "scene"


@app.command(help_epilogue="")
def check(name: str, *, data: Data = None, plugin: Plugins = []) -> int:  # noqa: B006 -- never changed
    """Say in words what is wrong with a scene: files, order of views, shift, rows, and whether truth explains them.

    Order, shift and rows are measured on matched features; truth by warping: the other views,
    sampled where it says, must look like the view it belongs to, and more so than with the truth
    one pixel off. Ends with status 1 if there is a problem, or if nothing shows that all pictures are
    views of one scene.

    **Examples**

    `matbench scene check my_scene`

    `matbench scene check hci/antinous --data DATA`

    Parameters
    ----------
    name
        The folder of a scene of your own, or the name of any scene.
    """
    from matbench.plans.plugins import using

    with using(plugin):
        return _check(name, data)


def _check(name: str, data: Path | None) -> int:
    from rich.text import Text

    from matbench.datasets.folder import describe
    from matbench.scenes.catalogue import load_scene, own_folder
    from matbench.scenes.scene_check import Observation, check, conclusion
    from matbench.spec import parse

    console, files = Console(), None
    told: list[Observation] = []
    marks = {"good": ("✓", "green"), "note": ("•", "yellow"), "problem": ("✗", "bold red"), "unknown": ("?", "yellow")}

    def tell(finding: Observation) -> None:
        told.append(finding)
        mark, style = marks[finding.verdict]
        line = Text.assemble((f"{mark} ", style), (f"{finding.topic}: ", "bold"), finding.text)
        console.print(line, soft_wrap=True, highlight=False)

    spec = parse(name)[0]
    folder = own_folder(spec.name) or (spec.name if "/" not in spec.name else None)
    with console.busy("reading") as status:
        if folder is not None:
            stored = describe(folder, spec.options)
            for problem in stored.problems():
                tell(Observation("files", "problem", problem))
            if told:
                return FAILED
            names = [path.name for path in stored.views]
            if len(set(names)) < len(names):  # one in each folder
                names = [os.path.relpath(path, folder) for path in stored.views]
            files = dict(zip(stored.labels, names, strict=True))
        scene = load_scene(name, data)
        size = f"{scene.n} views of {scene.width}x{scene.height} px"
        tell(Observation("files", "good", f"{size}, reference view {scene.labels[scene.ref]}"))
        if folder is not None and stored.column:
            turned = "they were taken one below the other, so all are turned by a quarter, counter-clockwise"
            tell(Observation("turned", "note", f"{turned}: maps of them must be, too"))
        status.update("matching features, warping views")
        for finding in check(scene, [files[label] for label in scene.labels] if files else None):
            tell(finding)
    said, is_shown = conclusion(told)
    console.say(said)
    return DONE if is_shown else FAILED


@app.command(help_epilogue="")
def new(
    folder: Path,
    *,
    disparities: Annotated[
        tuple[float, float] | None,
        Parameter(negative="", help="Least and largest, pixels per view step; default: measured."),
    ] = None,
    force: Annotated[bool, Parameter(negative="", help="Replace a scene.toml that is there.")] = False,
) -> int:
    """Write the scene.toml of a folder of images: the views in order, the range, and what else may stand there.

    Images are sorted as people do (im2 before im10), then by where features show that they were
    taken. Files called disp..., truth..., mask... are no views, and neither is what looks like a map. The
    range is measured, with a wide margin, unless you give it; so are uneven steps, and views that were taken
    one below the other.

    **Examples**

    `matbench scene new my_scene`

    `matbench scene new my_scene --disparities 0 24`

    Parameters
    ----------
    folder
        With the images: PNG, JPEG, TIFF, or binary PPM or PGM, all of one size.
    """
    from matbench.datasets import scaffold
    from matbench.spec import quoted

    console = Console()
    with console.busy("matching features"):
        draft = scaffold.write_scene_toml(folder, disparities, force)
    for remark in draft.remarks:
        console.say(f"• {remark}")
    console.say(f"written: {draft.path}")
    # only what has a slash may hold blanks
    path = f"./{folder}" if " " in str(folder) and "/" not in str(folder) else str(folder)
    console.say(f"next: {shlex.join(['matbench', 'scene', 'check', quoted(path)])}")
    return DONE
