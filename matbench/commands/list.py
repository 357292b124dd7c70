"""`matbench list`: methods with parameters, scenes with sizes, metrics, regions."""

import inspect
from collections.abc import Sequence
from contextlib import suppress
from itertools import groupby
from pathlib import Path
from typing import Annotated, Any

from cyclopts import App, Parameter
from rich.markup import escape
from rich.table import Column, Table

from matbench import parameters
from matbench.commands.console import DONE, Console, print_json
from matbench.commands.options import Data, Plugins
from matbench.errors import UserError
from matbench.measures.benchmarks import SETS
from matbench.measures.families import AT, Family
from matbench.plans import plugins
from matbench.regions import REGIONS
from matbench.results import metric_catalogue
from matbench.scenes.catalogue import listings, sets

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
        print_json(everything)
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
        "sets": {name: list(scenes) for name, scenes in sorted(sets().items())},
        "metrics": {m.name: {"unit": m.unit, "better": m.better, "about": m.about} for m in metric_catalogue.metrics()}
        | {family.name: _family(family) for family in metric_catalogue.families()}
        | {name: {"error": error} for name, error in metric_catalogue.broken_metrics().items()},
        "metric_sets": {name: {"about": one.about, "metrics": list(one.metrics)} for name, one in SETS.items()},
        "regions": REGIONS,
    }


def _family(family: Family) -> dict[str, Any]:
    """A family of metrics, as its metric of the largest number describes itself."""
    facts: dict[str, Any] = {"unit": "", "better": "", "about": family.about}
    with suppress(UserError):
        one = family.named(family.name.replace(AT, f"{family.most:g}"))
        facts |= {"unit": one.unit, "better": one.better}
    possible = f"{AT} a number from {family.least:g} to {family.most:g}"
    return facts | {"about": f"{family.about}; {possible}", "least": family.least, "most": family.most}


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
        "by_default": plugin.name in plugins.default_algorithms(),
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
        "endless": found.endless,
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
        lines += [] if facts["by_default"] else ["  runs when it is named"]
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
        scenes.add_row(
            escape(f"{name}[seed=0]") if facts["endless"] else escape(name), str(facts["views"]), sizes, truth, present
        )
    groups = Table(
        "set", "scenes", "the first", "the last", title="Sets: names for several scenes", title_justify="left"
    )
    for name, names in everything["sets"].items():
        groups.add_row(*(escape(text) for text in (name, str(len(names)), *(names[k] for k in (0, -1) if names))))
    metrics = Table("metric", "unit", "better", "about", title="Metrics", title_justify="left")
    for name, facts in everything["metrics"].items():
        if "error" in facts:
            metrics.add_row(escape(name), "", "", f"[red]{escape(facts['error'])}[/]")
            continue
        metrics.add_row(escape(name), facts["unit"], facts["better"], escape(facts["about"]))
    reported = Table("--metrics", "benchmark and metrics", title="Metrics of benchmarks", title_justify="left")
    for name, facts in everything["metric_sets"].items():
        reported.add_row(escape(name), escape(f"{facts['about']}: {', '.join(facts['metrics'])}"))
    regions = Table("region", "which pixels of the reference view", title="Regions", title_justify="left")
    for name, about in everything["regions"].items():
        regions.add_row(name, about)
    return [methods, scenes, groups, metrics, reported, regions]


def _shown(value: Any) -> str:
    if value is None:
        return "..., to be given"
    return str(value).lower() if isinstance(value, bool) else str(value)
