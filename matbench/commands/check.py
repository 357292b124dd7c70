"""`matbench check`: does a method keep its promises to the harness?"""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from attrs import asdict
from cyclopts import App, Parameter
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Column, Table

from matbench import spec
from matbench.commands.console import DONE, FAILED, Console, print_json
from matbench.commands.options import Plugins
from matbench.errors import UserError
from matbench.plans import limits, plugins
from matbench.plans.plan import Method
from matbench.plans.plan import methods as chosen
from matbench.solving import method_check
from matbench.solving.check_verdicts import CheckResult

app = App(
    name="check",
    help="Try methods: do they keep to what the harness asks of them?",
    help_epilogue="""\
Each solve has a process of its own: a method may hang or crash. Ends with status 1 if a check fails.

**Examples**

`matbench check mine.py`  every method in a file of your own

`matbench check okutomi_kanade 'materiality[preset=paper]'`

`matbench check 'command[program=./my_stereo]' --timeout 10`

`matbench check 'mine.py[share=0,1]' --json`
""",
    help_format="markdown",
)

_STYLES = {"pass": "green", "fail": "bold red", "skipped": "yellow", "note": "yellow"}


@app.default
def check(
    *method: str,
    timeout: Annotated[str, Parameter(help="Seconds that one solve may take; or none.")] = "120",
    plugin: Plugins = [],  # noqa: B006 -- never changed
    as_json: Annotated[bool, Parameter(name="--json", negative="", help="Machine-readable.")] = False,
) -> int:
    """Try methods on small scenes and tell, check by check, whether they pass.

    Parameters
    ----------
    method
        Names as for `compare`, with parameters if you like, or a Python file with methods of your own.
    """
    if not method:
        raise UserError("no method: name one, such as 'matbench check okutomi_kanade' or 'matbench check mine.py'")
    patience = limits.seconds(timeout) or math.inf
    ready, files = _read(method, plugin)
    console = Console()
    results: list[tuple[Method, list[CheckResult]]] = []
    columns = (BarColumn(24), MofNCompleteColumn(), TimeElapsedColumn(), TextColumn("{task.description}"))
    shown = console.is_interactive and not as_json
    for one in ready:
        with Progress(*columns, console=console, transient=True, disable=not shown) as progress:
            task = progress.add_task("starting", total=None)

            def listen(done: int, total: int, name: str) -> None:
                progress.update(task, completed=done, total=total, description=escape(f"{one}: {name}"))  # noqa: B023

            results.append((one, method_check.check(one, files, patience, listen)))
        if not as_json:
            console.print(_table(*results[-1]))
            console.say(_summary(*results[-1]))
    if as_json:
        print_json([{"method": str(one), "checks": [asdict(f) for f in found]} for one, found in results])
    return DONE if all(_passes(found) for _, found in results) else FAILED


def _read(names: Sequence[str], plugin: Sequence[Path]) -> tuple[list[Method], list[Path]]:
    """The methods that the words mean, and all files with methods."""
    files = [path.resolve() for path in plugin]
    selectors: list[str] = []
    for name in names:
        for one in [spec.Spec(name)] if Path(name).is_file() else spec.parse(name):
            if one.name.endswith(".py"):
                path = Path(one.name).resolve()
                files.append(path)
                held = plugins.from_file(path)
                if not held:
                    raise UserError(f"{name} holds no method: a class with solve(self, scene, context)")
                selectors += [spec.label(found, one.options) for found in held]
            else:
                selectors.append(str(one))
    return chosen(selectors, list(dict.fromkeys(files))), list(dict.fromkeys(files))


def _passes(found: Sequence[CheckResult]) -> bool:
    """Does no check fail, and was not everything skipped?"""
    verdicts = [finding.verdict for finding in found if finding.check != "quiet"]
    return "fail" not in verdicts and "pass" in verdicts


def _summary(method: Method, found: Sequence[CheckResult]) -> str:
    failed = [finding.check for finding in found if finding.verdict == "fail"]
    if failed:
        return f"{method} fails: {', '.join(failed)}"
    return f"{method} passes" if _passes(found) else f"{method}: nothing could be tried"


def _table(method: Method, found: Sequence[CheckResult]) -> Table:
    table = Table(
        Column("check", no_wrap=True), Column("", no_wrap=True), "what is asked", "what was found",
        title=escape(str(method)), title_justify="left",
    )  # fmt: skip
    for finding in found:
        style = _STYLES[finding.verdict]
        table.add_row(finding.check, f"[{style}]{finding.verdict}[/]", finding.demand, escape(finding.reason))
    return table
