"""Scores as published, beside measured ones of the same protocol: how faithful is a re-implementation?

The rows stand in ``published.csv``, who judged them on what in ``published.toml``. They are other people's programs,
so they are shown in grey and never ranked.
"""

import csv
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache
from importlib.resources import files
from io import StringIO
from typing import Any

import pandas as pd
from attrs import frozen
from rich.table import Table
from rich.text import Text

from matbench.errors import UserError
from matbench.reports import tables
from matbench.reports.paper import Format, md, tabular, tex
from matbench.reports.terminal import plain
from matbench.spec import label, read_scene

REMEMBERED = "remembered"
NONE = "–"


@frozen
class Row:
    """One published method on one scene.

    Parameters
    ----------
    scores
        Region -> the number, as it was printed.
    known
        Region -> ``read`` in the source for this table, or `REMEMBERED`: known from the literature, not read again.
    """

    method: str
    source: str
    scores: Mapping[str, str]
    known: Mapping[str, str]

    @property
    def remark(self) -> str:
        """The source, and what of the row is only remembered."""
        doubtful = [region for region, how in self.known.items() if how == REMEMBERED]
        if not doubtful:
            return self.source
        which = "" if len(doubtful) == len(self.known) else f" in {', '.join(doubtful)}"
        return f"{self.source}; {REMEMBERED}{which}"


@frozen(eq=False)
class Block:
    """One scene: the measured methods, best first, and the published rows.

    Parameters
    ----------
    about
        Who judged the published rows.
    measured
        Methods x regions, as texts.
    """

    scene: str
    about: str
    measured: pd.DataFrame
    published: tuple[Row, ...]

    @property
    def heads(self) -> list[str]:
        """The headings of the columns."""
        return ["method", *map(str, self.measured.columns), "source"]

    def lines(self) -> Iterator[tuple[bool, list[str]]]:
        """Each row of the table: is it published, and its texts: method, one for each region, remark."""
        regions = list(self.measured.columns)
        for method, row in self.measured.iterrows():
            yield False, [str(method), *map(str, row), ""]
        for one in self.published:
            yield True, [one.method, *(one.scores.get(region, NONE) for region in regions), one.remark]


@frozen(eq=False)
class Beside:
    """All scenes of a run that were judged as published, and why the others were not."""

    metric: str
    unit: str
    blocks: tuple[Block, ...]
    refused: tuple[str, ...]

    @property
    def title(self) -> str:
        return f"{self.metric} ({self.unit}) beside published rows"

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader must know."""
        return (
            "Published rows are other people's programs, on these two views and this range: not ranked. matbench "
            "derives the regions from the truth, so they may differ a little from the published ones.",
            f"{REMEMBERED}: known from the literature, not read again for this table.",
            *self.refused,
        )


@cache
def _rows() -> pd.DataFrame:
    text = files("matbench.reports").joinpath("published.csv").read_text(encoding="utf-8")
    return pd.read_csv(StringIO(text), dtype=str, keep_default_na=False)


@cache
def _protocols() -> Mapping[str, Any]:
    return tomllib.loads(files("matbench.reports").joinpath("published.toml").read_text(encoding="utf-8"))


def refusal(scene: str) -> str | None:
    """Why a scene, as named in a run, was not judged as published, in a line; None if it was.

    >>> refusal("middlebury2003/teddy[views=im2+im6]")
    >>> refusal("middlebury2003/teddy")
    'middlebury2003/teddy: published rows are of two views only: middlebury2003/teddy[views=im2+im6]'
    """
    asked = read_scene(scene)
    protocol = _protocol(asked.name)
    if protocol is None:
        return f"{scene}: no published rows of {asked.name} are known"
    views, searched, implied = (protocol["scenes"][asked.name][key] for key in ("views", "range", "implied"))
    faithful = label(asked.name, {"views": views} if implied else {"disparities": searched, "views": views})
    given = asked.options.get("views")
    if given is None or _numbers(given) != _numbers(views):
        return f"{scene}: published rows are of two views only: {faithful}"
    if asked.options.get("disparities", searched if implied else None) != searched:
        return f"{scene}: published rows are of the range {searched}: {faithful}"
    others = set(asked.options) - {"views", "disparities"}
    if others:
        return f"{scene}: published rows are without {', '.join(sorted(others))}: {faithful}"
    return None


def _numbers(views: str) -> list[str]:
    """The numbers of the views in an option, such as ``im2+im6``."""
    return [re.sub(r"^\D+", "", view) for view in views.split("+")]


def _protocol(scene: str) -> Mapping[str, Any] | None:
    return next((one for one in _protocols().values() if scene in one["scenes"]), None)


def check(scenes: Iterable[str], metric: str = tables.METRIC) -> None:
    """Refuse to show published rows where there are none.

    Raises
    ------
    UserError
        If none has that metric, or no scene was judged as published.
    """
    known = sorted(set(_rows()["metric"]))
    if metric not in known:
        raise UserError(f"published rows are known by {', '.join(known)} only, not by {metric}")
    why = [refusal(scene) for scene in scenes]
    if why and None not in why:
        left = len(why) - 1
        more = f" ({left} more {'scene has' if left == 1 else 'scenes have'} none)" if left else ""
        raise UserError(f"no published rows to show: {why[0]}{more}")


def beside(results: pd.DataFrame, cells: pd.DataFrame, metric: str = tables.METRIC) -> Beside:
    """The published rows of a run's scenes beside its own.

    Parameters
    ----------
    results, cells
        The two tables of a run.

    Raises
    ------
    UserError
        As `check`.
    """
    asked = tables.shared(results, cells).asked
    check(asked, metric)
    why = {scene: refusal(scene) or _other_size(results, scene) for scene in asked}
    blocks = [_block(results, scene, metric) for scene, reason in why.items() if reason is None]
    unit = tables.metrics(results).get(metric, "%")
    return Beside(metric, unit, tuple(blocks), tuple(reason for reason in why.values() if reason is not None))


def _block(results: pd.DataFrame, scene: str, metric: str) -> Block:
    name = read_scene(scene).name
    protocol = _protocol(name)
    assert protocol is not None  # noqa: S101 -- only scenes without a refusal come here
    published = _published(name, metric)
    regions = [r for r in tables.REGIONS if any(r in row.scores for row in published)]
    scores = {
        region: part.loc[scene]
        for region in regions
        if scene in (part := tables.per_scene(results, region, metric)).index
    }
    measured = pd.DataFrame(scores, columns=regions)
    measured = measured.sort_values(tables.REGION if tables.REGION in regions else regions[0], kind="stable")
    shown = measured.map(lambda value: tables.text(value, "%"))
    return Block(scene, str(protocol["about"]), shown, published)


def _other_size(results: pd.DataFrame, scene: str) -> str | None:
    """Why the pictures were not those of the published rows, as there are more pixels; None if they may be."""
    name = read_scene(scene).name
    protocol = _protocol(name)
    if protocol is None or "pixels" not in results:
        return None
    width, height = protocol["scenes"][name]["size"]
    counted = results[(results["scene"] == scene) & (results["region"] == tables.REGION)]["pixels"].astype(float).max()
    return f"{scene}: published rows are of {width}x{height} pixels" if counted > width * height else None


def _published(scene: str, metric: str) -> tuple[Row, ...]:
    rows = _rows()
    rows = rows[(rows["scene"] == scene) & (rows["metric"] == metric)]
    return tuple(
        Row(
            str(method),
            str(source),
            dict(zip(part["region"], part["value"], strict=True)),
            dict(zip(part["region"], part["known"], strict=True)),
        )
        for (method, source), part in rows.groupby(["method", "source"], sort=False)
    )


def terminal(made: Beside) -> list[Table]:
    """For the terminal: a table for each scene, published rows dimmed; notes below the last."""
    out = []
    for block in made.blocks:
        table = plain(f"{made.title}: {block.scene}")
        for number, head in enumerate(block.heads):
            is_word = number in (0, len(block.heads) - 1)
            table.add_column(head, justify="left" if is_word else "right", overflow="fold", no_wrap=not is_word)
        for is_published, texts in block.lines():
            table.add_row(*map(Text, texts), style="dim" if is_published else "")
        out.append(table)
    if out:
        out[-1].caption, out[-1].caption_justify = Text("\n".join(made.notes)), "left"
    return out


def markdown(made: Beside) -> str:
    """The same as Markdown, published rows in italics."""
    parts = []
    for block in made.blocks:
        rows = [[f"*{md(t)}*" if old and t else md(t) for t in texts] for old, texts in block.lines()]
        sides = ["left", *["right"] * (len(block.heads) - 2), "left"]
        table = pd.DataFrame(rows, columns=list(map(md, block.heads)))
        body = table.to_markdown(index=False, disable_numparse=True, colalign=sides)
        parts += [md(f"{made.title}: {block.scene}. {block.about}."), "", body, ""]
    return "\n".join([*parts, *(f"- {md(note)}" for note in made.notes)]) + "\n"


def latex(made: Beside) -> str:
    """The same as floating tables, for ``\\usepackage{xcolor}`` and what `paper.latex` needs; published rows grey."""
    lines = [r"% needs \usepackage{xcolor}, too"]
    for block in made.blocks:
        rows = [[rf"\textcolor{{gray}}{{{tex(t)}}}" if old else tex(t) for t in texts] for old, texts in block.lines()]
        align = "l" + "r" * (len(block.heads) - 2) + "l"
        lines += [
            r"\begin{table}",
            r"\centering\footnotesize",
            rf"\caption{{{tex(f'{made.title}: {block.scene}. {block.about}.')}}}",
            tabular(list(map(tex, block.heads)), rows, align),
            r"\par\smallskip",
            *(rf"\parbox{{\linewidth}}{{\footnotesize {tex(note)}}}\par" for note in made.notes),
            r"\end{table}",
        ]
    return "\n".join(lines) + "\n"


def comma_separated(made: Beside, columns: Sequence[str]) -> str:
    """One row for each published row, in the columns of `paper.comma_separated`; without a head."""
    rows = [
        {"scene": block.scene, "method": one.method, **one.scores, "metric": made.metric, "unit": made.unit}
        | {"note": f"published: {one.remark}"}
        for block in made.blocks
        for one in block.published
    ]
    return pd.DataFrame(rows).reindex(columns=list(columns)).to_csv(index=False, header=False, lineterminator="\n")


def appended(text: str, made: Beside, format: Format) -> str:
    """A table of `paper.formatted` with the published rows after it."""
    if format == "csv":
        return text + comma_separated(made, next(csv.reader(text.splitlines())))
    return text + "\n" + {"tex": latex, "md": markdown}[format](made)
