"""`matbench list`: methods with parameters, scenes with sizes, metrics, regions."""

import inspect
import json
from collections.abc import Sequence
from contextlib import suppress
from itertools import groupby
from pathlib import Path
from typing import Annotated, Any

from cyclopts import App, Parameter
from rich.markup import escape
from rich.table import Column, Table

from matbench import parameters
from matbench.commands.console import DONE, Console
from matbench.commands.options import Data, Plugins
from matbench.errors import UserError
from matbench.plans import plugins
from matbench.regions import REGIONS
from matbench.results import scores
from matbench.scenes.catalogue import listings

app = App(
    name="list",
    help="Show algorithms with their parameters, scenes with their sizes, and metrics.",
    help_epilogue="""\
**Examples**

`matbench list`

`matbench list --data ~/stereo --json`
""",
    help_format="markdown",
)

OPTIONS = """\
In brackets after a real or synthetic scene: views=3 (that many, as wide as they fit), views=0:9:2 or views=2+4+6 \
(by their labels), baseline=4 (view steps from the first to the last), ref=2 (the view to score), \
disparities=0:21 (to search, pixels of the pair), size=half, predict=right (that end view is held out)."""


@app.default
def list_(
    *,
    data: Data = None,
    plugin: Plugins = [],  # noqa: B006 -- never changed
    as_json: Annotated[bool, Parameter(name="--json", negative="", help="Machine-readable.")] = False,
) -> int:
    """Show algorithms with their parameters, scenes with their sizes, and metrics."""
    everything = known(data, plugin)
    if as_json:
        print(json.dumps(everything, indent=1))
    else:
        console = Console()
        for table in tables(everything):
            console.print(table)
    return DONE


def known(data: Path | None = None, files: Sequence[Path] = ()) -> dict[str, Any]:
    """Everything that can be named on the command line, as plain values for JSON."""
    with plugins.using(files):
        return _known(data, files)


def _known(data: Path | None, files: Sequence[Path]) -> dict[str, Any]:
    return {
        "algorithms": {name: _algorithm(plugin) for name, plugin in sorted(plugins.algorithms(files).items())},
        "scenes": {name: _scene(found) for name, found in listings(data).items()},
        "metrics": {m.name: {"unit": m.unit, "better": m.better, "about": m.about} for m in scores.metrics()}
        | {name: {"error": error} for name, error in scores.broken_metrics().items()},
        "regions": REGIONS,
    }


def _algorithm(plugin: plugins.Plugin) -> dict[str, Any]:
    facts: dict[str, Any] = {"source": plugin.source}
    try:
        cls = plugin.load()
        if not isinstance(cls, type):
            raise UserError(f"plug-in {plugin.name!r} from {plugin.source} is no class")
        known = parameters.parameters(cls)
    except UserError as error:
        return facts | {"error": str(error)}
    empty = inspect.Parameter.empty
    return facts | {
        "about": (inspect.getdoc(cls) or "").split("\n\n")[0].replace("\n", " "),
        "presets": sorted(parameters.presets_of(cls)),
        "parameters": {
            name: {
                "type": parameters.describe(one.kind),
                "default": None if one.default is empty else _plain(one.default),
            }
            | ({"group": one.group} if one.group else {})
            for name, one in known.items()
        },
        "reads": _reads(plugin, cls),
    }


def _reads(plugin: plugins.Plugin, cls: type) -> list[str]:
    """The files that a method with its defaults says it reads; none where something must be given, or is wrong."""
    if hasattr(cls, "reads") or hasattr(cls, "code_files"):  # else it need not be made
        with suppress(UserError):
            return [str(path) for path in plugins.declared(plugin.name, plugin.make({}))]
    return []


def _plain(value: Any) -> Any:
    return value if type(value) in (bool, int, float, str) else str(value)


def _scene(found: Any) -> dict[str, Any]:
    if isinstance(found, UserError):
        return {"error": str(found)}
    return {
        "views": found.views,
        "sizes": {k: list(v) for k, v in found.sizes.items()},
        "truth": found.truth,
        "present": found.present,
    }


def tables(everything: dict[str, Any]) -> list[Table]:
    """What `known` gives, as tables for a terminal."""
    methods = Table("algorithm", "parameters and defaults", title="Algorithms", title_justify="left", expand=False)
    for name, facts in everything["algorithms"].items():
        if "error" in facts:
            methods.add_row(escape(name), f"[red]{escape(facts['error'])}[/]")
            continue
        lines = [facts["about"], *(f"  preset={preset}" for preset in facts["presets"])]
        for group, members in groupby(facts["parameters"].items(), key=lambda item: item[1].get("group", "")):
            lines += [f" {group.replace('_', ' ')}:"] if group else []
            lines += [f"  {key}={_shown(one['default'])}: {one['type']}" for key, one in members]
        lines += [f"  reads {file}" for file in facts["reads"]]
        methods.add_row(escape(name), escape("\n".join(lines)))
    scenes = Table(
        Column("scene", no_wrap=True),
        "views",
        "sizes (default first)",
        "truth",
        "present",
        title="Scenes",
        title_justify="left",
        caption=OPTIONS,
        caption_justify="left",
    )
    for name, facts in everything["scenes"].items():
        if "error" in facts:
            scenes.add_row(escape(name), "", f"[red]{escape(facts['error'])}[/]", "no", "no")
            continue
        dims = {size: f"{w}x{h}" if w else "" for size, (w, h) in facts["sizes"].items()}
        sizes = ", ".join(" ".join(dict.fromkeys((size, wide))).strip() for size, wide in dims.items())
        truth, present = ("yes" if facts[key] else "no" for key in ("truth", "present"))
        scenes.add_row(escape(name), str(facts["views"]), sizes, truth, present)
    metrics = Table("metric", "unit", "better", "about", title="Metrics", title_justify="left")
    for name, facts in everything["metrics"].items():
        if "error" in facts:
            metrics.add_row(escape(name), "", "", f"[red]{escape(facts['error'])}[/]")
            continue
        metrics.add_row(escape(name), facts["unit"], facts["better"], escape(facts["about"]))
    regions = Table("region", "which pixels of the reference view", title="Regions", title_justify="left")
    for name, about in everything["regions"].items():
        regions.add_row(name, about)
    return [methods, scenes, metrics, regions]


def _shown(value: Any) -> str:
    if value is None:
        return "..., to be given"
    return str(value).lower() if isinstance(value, bool) else str(value)
