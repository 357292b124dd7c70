"""`matbench fetch`: download real scenes from the sites that publish them."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter
from rich.markup import escape
from rich.progress import BarColumn, DownloadColumn, Progress, TextColumn, TransferSpeedColumn

from matbench.commands.console import DONE, FAILED, INTERRUPTED, Console
from matbench.commands.streams import spare_output
from matbench.errors import UserError
from matbench.files.transfer import PATIENCE, Patience
from matbench.scenes.dataset import Download
from matbench.scenes.downloads import downloads, fetch_root
from matbench.scenes.fetching import Event, Result, look, site_of
from matbench.scenes.fetching import fetch as bring

app = App(
    name="fetch",
    help="Download scenes, check them, and put them in place.",
    help_epilogue="""\
Typed again after an interruption, the same command goes on where it was. Files that are there
already are checked and left alone. Files come from https://vision.middlebury.edu/stereo/data/;
they are free for research, and ask for citation.

**Examples**

`matbench fetch paper`  the paper's three scenes

`matbench fetch 'middlebury2006/*' --dry-run`

`matbench fetch 'middlebury2006/*[size=half]' middlebury2003/teddy --data ~/stereo`

`matbench fetch middlebury2001/venus --mirror http://localhost:8000`
""",
    help_format="markdown",
)

_SHOWN = 4  # reasons printed for one scene


@app.default
def fetch(
    scene: Annotated[list[str], Parameter(negative="")],
    /,
    *,
    data: Annotated[
        Path | None,
        Parameter(
            help="Folder to put scenes in; else MATBENCH_DATA names it, else one of your own, where all commands look."
        ),
    ] = None,
    mirror: Annotated[
        str | None, Parameter(help="Address that stands in for the official site's, laid out as that is.")
    ] = None,
    dry_run: Annotated[bool, Parameter(negative="", help="Only say what would be brought, and from where.")] = False,
    timeout: Annotated[float, Parameter(help="Seconds of (almost) nothing after which a connection has stalled.")] = 30,
    retries: Annotated[int, Parameter(help="How often to try again while nothing more comes.")] = 4,
) -> int:
    """Download scenes, check every file, and put it where `compare` finds it.

    Parameters
    ----------
    scene
        Scenes or patterns, as for `compare -s`, a size in brackets; `paper` is the paper's three.
    """
    console = Console()
    chosen, left_out = downloads(scene)
    root, site = fetch_root(data), None if mirror is None else site_of(mirror)
    if not 0 < timeout <= 3600:
        raise UserError(f"timeout {timeout:g} is not between 0 and 3600 seconds")
    if not 0 <= retries <= 100:
        raise UserError(f"retries {retries} is not a whole number from 0 to 100")
    for one in left_out:
        console.say(f"without {one}")
    if dry_run:
        _plan(console, list(look(chosen, root)), site)
        return DONE
    return _fetch(console, chosen, root, site, Patience(timeout, retries, PATIENCE.pause))


def _count(count: int, what: str) -> str:
    return f"{count} {what}{'' if count == 1 else 's'}"


def _files(count: int) -> str:
    return _count(count, "file")


def _megabytes(count: int) -> str:
    return f"{count / 1e6:.1f} MB"


def _plan(console: Console, looked: Sequence[Result], site: str | None) -> None:
    """Print what would be fetched, and from where."""
    total = 0
    for result in looked:
        one, missing = result.download, set(result.missing)
        size = sum(file.bytes for file in one.files if file.name in missing)
        total += size
        if not missing:
            console.say(f"{one.name}: all {_files(len(one.files))} there, under {result.folder}")
            continue
        console.say(f"{one.name}: {len(missing)} of {_files(len(one.files))}, {_megabytes(size)}, to {result.folder}")
        for reason in result.reasons:
            console.say(f"  {reason}")
        for at, source in enumerate(one.sources):
            console.say(f"  {'from' if at == 0 else 'else'} {site or one.site}{source}")
    console.say(f"in all {_megabytes(total)} of pictures; an archive's size is known when it comes")


def _fetch(console: Console, chosen: Sequence[Download], root: Path, site: str | None, patience: Patience) -> int:
    """Fetch scenes with progress shown, and print a summary; the exit status."""
    spare_output()
    results: list[Result] = []
    columns = (BarColumn(24), TextColumn("{task.description}"), DownloadColumn(), TransferSpeedColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_interactive) as progress:
        task = progress.add_task("starting", total=None)

        def listen(event: Event, what: str, done: int, total: int | None) -> None:
            if event == "scene":
                progress.update(task, description=f"{place} {escape(what)}", completed=0, total=None)
            elif event == "bytes":
                file = escape(what.rpartition("/")[2])
                progress.update(task, description=f"{place} {file}", completed=done, total=total)
            elif event == "waiting":
                console.say(f"waiting: {what} is being fetched by another matbench")

        place = f"1/{len(chosen)}"
        interrupted = False
        try:
            for result in bring(chosen, root, mirror=site, patience=patience, listen=listen):
                results.append(result)
                place = f"{len(results) + 1}/{len(chosen)}"
                console.say(_outcome(result))
        except KeyboardInterrupt:
            interrupted = True
    _account(console, results, root)
    if interrupted:
        console.say("interrupted: the same command goes on from here")
        return INTERRUPTED
    return FAILED if any(result.missing for result in results) else DONE


def _outcome(result: Result) -> str:
    """The result of one scene, in one line."""
    name, every = result.download.name, len(result.download.files)
    if result.missing:
        return f" failed  {name}: {len(result.missing)} of {_files(every)} missing"
    if not result.came:
        return f"  there  {name}: {_files(every)}"
    already = f", {len(result.there)} there already" if result.there else ""
    return f"   came  {name}: {_files(len(result.came))}, {_megabytes(result.bytes)}{already}"


def _account(console: Console, results: Sequence[Result], root: Path) -> None:
    """Print what came, what was there, what failed and why, and how to get it by hand."""
    failed = [result for result in results if result.missing]
    for result in failed:
        console.say(f"\n{result.download.name}: {', '.join(result.missing)} missing")
        for reason in result.reasons[:_SHOWN]:
            console.say(f"  {reason}")
        if len(result.reasons) > _SHOWN:
            console.say(f"  and so on, for {len(result.reasons) - _SHOWN} more")
        for at, url in enumerate(result.urls):
            console.say(f"  {'or' if at else 'by hand'} from {url}")
        console.say(f"  to {result.folder}/")
    if failed:
        console.say("\nthe same command tries again, and checks what was placed by hand")
    came = sum(bool(result.came) and not result.missing for result in results)
    there = len(results) - came - len(failed)
    amount = _megabytes(sum(result.bytes for result in results))
    console.say(f"{_count(came, 'scene')} came ({amount}), {there} there already, {len(failed)} failed; folder: {root}")
