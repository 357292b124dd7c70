"""The tables of a run in a terminal. They fit 80 columns, and brackets in names are not read as markup."""

from collections.abc import Iterable, Mapping, Sequence

import pandas as pd
from rich import box
from rich.console import Console
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

from matbench.measures.metrics import Better
from matbench.measures.statistics import FEW
from matbench.reports.costs import CLOCK, timing_note
from matbench.reports.standing import correction, lead, told, words
from matbench.reports.tables import (
    ASIDE,
    METRIC,
    REGION,
    REGIONS,
    VIEWS,
    Shared,
    aside_note,
    count,
    interval,
    labelled,
    means,
    metrics,
    per_scene,
    places,
    regions,
    shared,
    summarised,
    summary,
    too_silent,
)
from matbench.reports.tables import text as shown

WIDTH = 80
NARROW = ("disc", "textureless")
_PADDING = 2
_NAMES = 12  # columns that the names of scenes have at least
_NAMED_METHOD, _METRIC = 24, 11  # columns that a method's name, and a metric, take at most
_LOG = r" \(log: [^ ]+\)$"
_SCENES = 30  # scenes that have a line of their own
_NAMED = 3  # scenes that are named where a method fails on many for the same reason


def tables(
    results: pd.DataFrame,
    cells: pd.DataFrame,
    metric: str = METRIC,
    better: Better = "lower",
    width: int = WIDTH,
    others: Mapping[str, Better] = {},
) -> list[Table]:
    """The summary, its other regions, other metrics, every scene, and the failed cells; empty tables are left out.

    Where the summary does not fit the terminal it leaves out the regions of `NARROW`.

    Parameters
    ----------
    others
        Further metrics, which are shown in `REGION` -> which direction of them is better.
    """
    results, cells = labelled(results), labelled(cells)
    scope = shared(results, cells)
    out = []
    rows = summary(results, cells, metric, better) if len(results) else pd.DataFrame()
    if scope.methods and len(results):
        heads = {f"{metric} {r}": r.replace("textureless", "texture-\nless") for r in REGIONS}
        heads |= {"avg all": "avg\nall", "seconds": f"{CLOCK}\ntime"}
        by_region = _summary(rows, results, cells, scope, metric, better, "by region", heads)
        if width < WIDTH or _least_width(by_region) > width:
            heads = {column: head for column, head in heads.items() if column.split()[-1] not in NARROW}
            by_region = _summary(rows, results, cells, scope, metric, better, "by region", heads)
        out.append(by_region)
        over_views = [r for r in summarised(results) if r in VIEWS]
        if per_scene(results, VIEWS[0], metric).notna().any(axis=None):
            heads = {f"{metric} {r}": r.replace("_", "_\n", 1) for r in over_views}
            out.append(_summary(rows, results, cells, scope, metric, better, "by the views that see a point", heads))
        out += _differences(rows, results, cells, metric, better)
        own = [r for r in regions(results[results["metric"] == metric]) if r not in (*REGIONS, *VIEWS)]
        if own:
            heads = {f"{metric} {r}": r.replace("_", "_\n", 1) for r in own}
            out.append(_summary(rows, results, cells, scope, metric, better, "by the scenes' own regions", heads, own))
        measured = [m for m in (metric, *others) if m in set(results["metric"])]
        if len(measured) > 1:
            out += _by_metric(results, cells, scope, measured, {metric: better, **others}, width)
    if len(results):
        out += _scenes([str(m) for m in rows.index], results, cells, scope, metric, better, width)
    bad = cells[cells["status"] != "ok"]
    if len(bad):
        out.append(_bad(bad))
    return out


def plain(title: str) -> Table:
    """An empty table as all of them look."""
    table = Table(title=Text(title), title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False)
    table.padding = (0, 1, 0, 0)  # with the box's own column two blanks, so that methods' names fit, too
    return table


def _least_width(table: Table) -> int:
    """The columns of a terminal below which numbers of a table are cut off."""
    unbounded = Console(width=1000)
    return Measurement.get(unbounded, unbounded.options, table).minimum


def _number(value: float, unit: str, place: int, is_aside: bool = False) -> Text:
    mark = ASIDE if is_aside and pd.notna(value) else ""
    return Text(shown(value, unit) + mark, style="bold" if place == 1 else "")


def _summary(
    rows: pd.DataFrame,
    results: pd.DataFrame,
    cells: pd.DataFrame,
    scope: Shared,
    metric: str,
    better: Better,
    what: str,
    heads: dict[str, str],
    own: Sequence[str] = (),
) -> Table:
    """Methods x the columns of the summary, `rows`, that have a heading; below, how many scenes each is over."""
    unit = metrics(results).get(metric, "%")
    rows = rows.assign(**{f"{metric} {r}": means(results, scope, r, metric).reindex(rows.index) for r in own})
    hint = "; too few scenes to conclude" if scope.distinct < FEW else ""
    over = f"{len(scope.scenes)} of {len(scope.asked)} scenes{f' ({scope.mixture})' if scope.mixture else ''}"
    table = plain(f"{metric} ({unit}) {what}, mean over {over}{hint}")
    table.show_footer = len(scope.scenes) > 1
    table.add_column("#", justify="right", no_wrap=True)
    table.add_column("method", Text("scenes", style="italic"), overflow="fold", min_width=12)
    units = {column: {"avg all": "px", "seconds": "s"}.get(column, unit) for column in heads}
    marks: dict[str, pd.Series] = {}
    asides: dict[str, set[str]] = {}
    for column, head in heads.items():
        (name, _, region), counted = column.partition(" "), len(scope.scenes)
        asides[column] = set(rows.index[~rows["alike"]]) if column == "seconds" else set()
        if column != "seconds":
            counted = count(per_scene(results, region, name), scope)
            asides[column] = set(too_silent(means(results, scope, region, name, "answered")))
        rivals = [m for m in rows.index if scope.is_ranked(m) and m not in asides[column]]
        marks[column] = places(rows.loc[rivals, column], units[column], better if name == metric else "lower")
        table.add_column(
            Text(f"{head}\n{units[column]}"),
            Text(str(counted), style="italic"),
            justify="right",
            no_wrap=True,
            vertical="top",
        )
    for number, (method, row) in enumerate(rows.iterrows(), 1):
        label = Text(str(method))
        if row["remark"]:
            label.append(f"\n{row['remark']}", style="italic")
        values = [_number(row[c], u, marks[c].get(method, 0), method in asides[c]) for c, u in units.items()]
        table.add_row(str(number), label, *values, style="" if row["ranked"] else "dim")
    notes = [aside_note()] if any(asides[c] for c in heads if c != "seconds") else []
    if "seconds" in heads and (note := timing_note(cells)):
        notes.append(note)
    table.caption, table.caption_justify = Text("\n".join(notes)) if notes else None, "left"
    return table


def _by_metric(
    results: pd.DataFrame,
    cells: pd.DataFrame,
    scope: Shared,
    names: Sequence[str],
    better: Mapping[str, Better],
    width: int,
) -> list[Table]:
    """Methods x metrics, means in `REGION`, in as many tables as it takes to stay within the width."""
    rows, units = summary(results, cells, names[0], better[names[0]]), metrics(results)
    columns = {name: means(results, scope, REGION, name) for name in names}
    asides = {name: too_silent(means(results, scope, REGION, name, "answered")) for name in names}
    at_once, out = max(1, (min(width, WIDTH) - _NAMED_METHOD) // _METRIC), []
    for start in range(0, len(names), at_once):
        part = names[start : start + at_once]
        table = plain(f"by metric, in {REGION!r}, mean over {len(scope.scenes)} of {len(scope.asked)} scenes")
        table.add_column("method", overflow="fold", min_width=12)
        marks = {}
        for name in part:
            rivals = [str(m) for m in rows.index if scope.is_ranked(str(m)) and m not in asides[name]]
            marks[name] = places(columns[name].reindex(rivals), units[name], better[name])
            head = name.replace("_", "_\n") + (f"\n{units[name]}" if units[name] else "")
            table.add_column(Text(head), justify="right", no_wrap=True, vertical="top")
        for method, row in rows.iterrows():
            values = [
                _number(columns[n][str(method)], units[n], marks[n].get(method, 0), method in asides[n]) for n in part
            ]
            table.add_row(Text(str(method)), *values, style="" if row["ranked"] else "dim")
        if any(asides[name] for name in part):
            table.caption, table.caption_justify = Text(aside_note()), "left"
        out.append(table)
    return out


def _differences(
    rows: pd.DataFrame, results: pd.DataFrame, cells: pd.DataFrame, metric: str, better: Better
) -> list[Table]:
    """Is it real? The differences from the best method, with intervals and verdicts."""
    found = lead(results, cells, metric, better, rows=rows)
    if not found.behind:
        return []
    unit = metrics(results).get(metric, "%")
    table = plain(f"{metric} ({unit}) in {REGION!r}: difference from {found.best}, paired by scene")
    table.add_column("method", overflow="fold", min_width=12)
    for head in ("mean", "95 % interval"):
        table.add_column(head, justify="right", no_wrap=True)
    table.add_column("verdict", overflow="fold")
    for method, effect in found.behind.items():
        said = words(told(effect), better == "higher")
        ends = interval(effect.low, effect.high)
        table.add_row(Text(method), Text(shown(effect.mean, "%", signed=True)), Text(ends), Text(said))
    table.caption, table.caption_justify = Text(correction(found.compared)), "left"
    return [table]


def _short(scenes: Iterable[str]) -> dict[str, str]:
    """Scene -> its name without the dataset, if the names still differ."""
    tails = {scene: scene if scene[:1] in "\"'" else scene.partition("/")[2] or scene for scene in scenes}
    return tails if len(set(tails.values())) == len(tails) else {scene: scene for scene in tails}


def _headings(methods: list[str], numbers: dict[str, int], room: int) -> list[str]:
    """The methods' names, broken after underscores; if they do not fit side by side, their numbers in the summary."""
    names = [m.replace("_", "_\n") for m in methods]
    fits = sum(max(len(part) for part in n.split("\n")) + _PADDING for n in names) <= room
    return names if fits else [f"#{numbers[m]}" for m in methods]


def _scenes(
    methods: list[str],
    results: pd.DataFrame,
    cells: pd.DataFrame,
    scope: Shared,
    metric: str,
    better: Better,
    width: int,
) -> list[Table]:
    """Scenes x methods, in as many tables as it takes to stay within the width."""
    room = min(width, WIDTH)
    unit = metrics(results).get(metric, "%")
    numbers = {m: i for i, m in enumerate(methods, 1)}
    values, answered = (
        per_scene(results, REGION, metric, column).reindex(index=list(scope.asked), columns=methods)
        for column in ("value", "answered")
    )
    names = _short(scope.asked)
    # the column of scenes, as wide as it will be, and its own padding
    first = max(_NAMES, min(max(map(len, names.values()), default=0), 28)) + _PADDING
    heads = _headings(methods, numbers, room - first)
    at_once = len(methods) if not heads[0].startswith("#") else max(1, (room - first) // (7 + _PADDING))
    bad = cells[cells["status"] != "ok"]
    status = {(m, s): state for m, s, state in zip(bad["method"], bad["scene"], bad["status"], strict=True)}
    out = []
    for start in range(0, len(methods), at_once):
        part = methods[start : start + at_once]
        table = plain(f"{metric} ({unit}) in {REGION!r}, scene by scene")
        if (more := len(values) - _SCENES) > 0:
            table.caption, table.caption_justify = Text(f"and {more} more scenes: results.csv has them"), "left"
        table.add_column("scene", overflow="fold", min_width=_NAMES)
        for head in heads[start : start + at_once]:
            table.add_column(Text(head), justify="right", overflow="fold")
        shown_first = zip(values.head(_SCENES).iterrows(), answered.head(_SCENES).iterrows(), strict=True)
        for (scene, row), (_, over) in shown_first:
            asides = too_silent(over)
            marks = places(row[[m for m in methods if scene in scope.has[m] and m not in asides]], unit, better)
            shown_row = [
                Text(status[m, str(scene)], style="italic")
                if (m, scene) in status
                else _number(row[m], unit, marks.get(m, 0), m in asides)
                for m in part
            ]
            table.add_row(Text(names[str(scene)]), *shown_row)
        out.append(table)
    return out


def _bad(bad: pd.DataFrame) -> Table:
    """The cells without a score; those of one method with the same reason are in one row."""
    table = plain(f"{len(bad)} cell{'s' if len(bad) != 1 else ''} without a score")
    for head in ("method", "scene", "seed", "status", "reason"):
        table.add_column(head, overflow="fold", justify="right" if head == "seed" else "left")
    bad = bad.fillna({"reason": ""})
    alike = bad["reason"].astype(str).str.replace(_LOG, "", regex=True)  # each cell has a log of its own
    for (method, status, _), rows in bad.groupby(["method", "status", alike], sort=False):
        scenes = list(dict.fromkeys(map(str, rows["scene"])))
        more = [f"and {len(scenes) - _NAMED} more"] if len(scenes) > _NAMED else []
        seeds = ", ".join(map(str, dict.fromkeys(rows["seed"])))
        where = Text("\n".join([*scenes[:_NAMED], *more]))
        table.add_row(Text(str(method)), where, seeds, str(status), Text(str(rows["reason"].iloc[0])))
    return table
