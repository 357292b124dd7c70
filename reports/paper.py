"""The table of a run for a paper, as LaTeX, Markdown or CSV.

`Sheet` decides once what is shown, and every format writes its texts. So all formats and the page agree to the
last digit.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import chain
from typing import Any, Literal, get_args

import pandas as pd
from attrs import frozen

from matbench.errors import UserError, unknown
from matbench.files.csv_tables import csv_text
from matbench.measures.metrics import Better
from matbench.measures.statistics import FEW
from matbench.reports import standing, tables
from matbench.reports.tables import METRIC, NOT_RANKED, REGION, REGIONS, Shared
from matbench.results.comparable import SILENT
from matbench.safe_text import printable

Format = Literal["tex", "md", "csv"]
FORMATS: tuple[Format, ...] = get_args(Format)
MEAN, RANK = "mean", "mean rank"
NONE = "–"


@frozen(eq=False)
class Sheet:
    """The content of a table, as texts.

    Parameters
    ----------
    metric, unit
        What is shown.
    better
        Which direction of it is better.
    texts
        One row for each method, over all scenes and in each: ``scene`` (`MEAN` for all), ``method``,
        every region, `RANK`; numbers as shown, `NONE` where there is none.
    places
        The same rows and number columns: 1 best, 2 second, 0 neither; `NOT_RANKED` where a number is shown but not
        ranked.
    counts
        Region -> how many scenes its means are over.
    unranked
        Method -> why it is not ranked.
    notes
        What else a reader must know: failed cells, too few scenes.
    """

    metric: str
    unit: str
    better: Better
    texts: pd.DataFrame
    places: pd.DataFrame
    counts: Mapping[str, int]
    unranked: Mapping[str, str]
    notes: tuple[str, ...]

    @property
    def regions(self) -> list[str]:
        return [str(c) for c in self.texts.columns if c not in ("scene", "method", RANK)]

    @property
    def judged(self) -> str:
        """The region that methods are ordered and ranked by."""
        return _judged(self.regions)

    @property
    def has_scenes(self) -> bool:
        """Are there rows of single scenes?"""
        return bool((self.texts["scene"] != MEAN).any())

    @property
    def caption(self) -> str:
        unit = f" ({self.unit})" if self.unit else ""
        which = "nearer to 0" if self.better == "zero" else self.better
        rank = f"{RANK.capitalize()}: the place by {self.metric} in {self.judged}, mean over scenes."
        return f"{self.metric}{unit} by region; {which} is better. Best in bold, second underlined. {rank}"


def _judged(regions: Sequence[str]) -> str:
    return REGION if REGION in regions else regions[0]


def sheet(
    results: pd.DataFrame,
    cells: pd.DataFrame,
    metric: str = METRIC,
    better: Better = "lower",
    regions: Sequence[str] = (),
    by_scene: bool = True,
) -> Sheet:
    """Make the table of a run.

    Parameters
    ----------
    results, cells
        The two tables of a run.
    metric
        What is shown.
    better
        Which direction of it is better.
    regions
        The columns; if none are named, the field's own regions that were scored.
    by_scene
        Show every scene after the means, if there are several?

    Raises
    ------
    UserError
        If nothing was scored at all, by that metric, or in one of the regions.
    """
    if results.empty:
        raise UserError(tables.none_scored(cells))
    results, cells = tables.labelled(results), tables.labelled(cells)
    units = tables.metrics(results)
    if metric not in units:
        raise unknown("metric of this run", metric, units)
    scored = tables.regions(results[results["metric"] == metric])
    for region in regions:
        if region not in scored:
            raise unknown(f"region of {metric} in this run", region, scored)
    chosen = list(dict.fromkeys(regions)) or [r for r in REGIONS if r in scored] or scored
    scope, unit = tables.shared(results, cells), units[metric]
    by_region, over = (
        {
            r: tables.per_scene(results, r, metric, column).reindex(list(scope.asked), columns=list(scope.methods))
            for r in chosen
        }
        for column in ("value", "answered")
    )
    means, shares = (
        pd.DataFrame({r: tables.over_scenes(table, scope) for r, table in part.items()}) for part in (by_region, over)
    )
    judged = by_region[_judged(chosen)]
    silent = tables.too_silent(shares[_judged(chosen)])
    means[RANK] = pd.Series(standing.mean_ranks(judged, scope, unit, better, silent))
    unranked = pd.Series([not scope.is_ranked(m) or m in silent for m in scope.methods], index=list(scope.methods))
    by = {"unranked": unranked, "merit": tables.merit(means[_judged(chosen)], better)}
    order = pd.DataFrame(by).sort_values(list(by), kind="stable")
    blocks = {MEAN: (means, shares)}
    for scene in scope.asked if by_scene and len(scope.asked) > 1 else ():
        block = pd.DataFrame({r: table.loc[scene] for r, table in by_region.items()})
        block = block.where(pd.Series({m: scene in scope.has[m] for m in scope.methods}), axis=0)
        here = pd.DataFrame({r: table.loc[scene] for r, table in over.items()})
        apart = tables.too_silent(here[_judged(chosen)])
        block[RANK] = pd.Series(standing.mean_ranks(judged.loc[[scene]], scope, unit, better, apart))
        blocks[scene] = (block, here)
    texts, places = [], []
    for name, (block, answered) in blocks.items():
        rows = block.reindex([str(m) for m in order.index])
        rivals = [m for m in rows.index if scope.is_ranked(m) or name != MEAN]
        shown, marks = {}, {}
        for column in rows.columns:
            kind = "%" if column == RANK else unit  # ranks have two decimals, too
            shown[column] = [tables.text(v, kind) for v in rows[column]]
            apart = {} if column == RANK else tables.too_silent(answered[column])
            ranked = rows.loc[[m for m in rivals if m not in apart], column]
            found = tables.places(ranked, kind, "lower" if column == RANK else better)
            marks[column] = [
                NOT_RANKED if m in apart and pd.notna(rows.loc[m, column]) else int(found.get(m, 0)) for m in rows.index
            ]
        texts.append(pd.DataFrame({"scene": name, "method": list(rows.index), **shown}))
        places.append(pd.DataFrame(marks))
    why = {
        m: f"not ranked: mean over {len(scope.counted(m))} of {len(scope.asked)} scenes"
        for m in scope.methods
        if not scope.is_ranked(m)
    }
    counts = {r: tables.count(table, scope) for r, table in by_region.items()}
    notes = _notes(cells, scope, counts)
    if any((part == NOT_RANKED).any(axis=None) for part in places):
        told = (f"{m} {r} {tables.share(v)}" for r in chosen for m, v in tables.too_silent(shares[r]).items())
        said = "; ".join(told)
        notes.append(f"{tables.aside_note()}{f' (answered: {said})' if said else ''}.")
    notes += [f"{m}: {said}." for m, said in tables.silences(results, scope).items()]
    return Sheet(
        metric,
        unit,
        better,
        pd.concat(texts, ignore_index=True),
        pd.concat(places, ignore_index=True),
        counts,
        why,
        tuple(notes),
    )


def _notes(cells: pd.DataFrame, scope: Shared, counts: Mapping[str, int]) -> list[str]:
    mixed = f" ({scope.mixture}; each weighs the same)" if scope.mixture else ""
    count = f"Means over {len(scope.scenes)} of {len(scope.asked)} scenes{mixed}"
    notes = [count + (": too few to conclude." if scope.distinct < FEW else ".")]
    fewer = [f"{region} {some}" for region, some in counts.items() if some != len(scope.scenes)]
    if fewer:
        notes.append(f"Scenes in which a region holds too few pixels do not count in it: {', '.join(fewer)}.")
    bad = cells[cells["status"] != "ok"]
    for row in bad.to_dict("records"):
        reason = "" if pd.isna(row.get("reason")) else " ".join(str(row["reason"]).split())
        seed = f", seed {row['seed']}" if row.get("seed") else ""
        notes.append(f"{row['method']} on {row['scene']}{seed}: {row['status']}" + (f" ({reason})." if reason else "."))
    return notes


def formatted(made: Sheet, format: Format) -> str:
    """The table in one of `FORMATS`."""
    return together([made], format)


def together(made: Sequence[Sheet], format: Format) -> str:
    """The tables of several metrics in one of `FORMATS`, one below the other; as CSV they are one table."""
    if format == "csv":
        return comma_separated(*made)
    return "\n".join({"tex": latex, "md": markdown}[format](one) for one in made)


def comma_separated(*made: Sheet) -> str:
    """One row for each metric, scene and method, `MEAN` first; what was left without a number is told in ``note``."""
    return csv_text(pd.concat(map(_noted, made), ignore_index=True))


def _noted(made: Sheet) -> pd.DataFrame:
    unranked = made.texts["method"].map(dict(made.unranked)).where(made.texts["scene"] == MEAN)
    apart = [[region for region in made.regions if row[region] == NOT_RANKED] for _, row in made.places.iterrows()]
    notes = [
        "; ".join([*([note] if isinstance(note, str) else []), *([f"{SILENT} in {', '.join(some)}"] if some else [])])
        for note, some in zip(unranked, apart, strict=True)
    ]
    more = pd.DataFrame({"metric": made.metric, "unit": made.unit, "note": notes})
    # not `assign`: a region may be called "note"
    return pd.concat([made.texts.replace(NONE, ""), more], axis=1)


def _heads(made: Sheet) -> list[str]:
    return ["scene", "method", *made.regions, RANK][0 if made.has_scenes else 1 :]


def _rows(made: Sheet) -> "list[tuple[bool, list[tuple[str, int]]]]":
    """Each row: is it the first of its scene, and its texts with their places. A scene is named in its first row."""
    out, before = [], None
    for (_, row), (_, marks) in zip(made.texts.iterrows(), made.places.iterrows(), strict=True):
        is_new = row["scene"] != before
        before = row["scene"]
        mark = "†" if row["scene"] == MEAN and row["method"] in made.unranked else ""
        head = [(str(row["scene"]) if is_new else "", 0), (f"{row['method']}{mark}", 0)]
        numbers = [(str(row[c]), int(marks[c])) for c in (*made.regions, RANK)]
        out.append((is_new, [*head, *numbers][0 if made.has_scenes else 1 :]))
    return out


def _told(made: Sheet) -> list[str]:
    return [*made.notes, *(f"† {method}: {why}." for method, why in made.unranked.items())]


def markdown(made: Sheet) -> str:
    """A table as GitHub and most others read it, its caption above and its notes below."""
    marks = {0: "{}", 1: "**{}**", 2: "<ins>{}</ins>", NOT_RANKED: "{}" + md(tables.ASIDE)}
    heads, left = list(map(md, _heads(made))), 2 if made.has_scenes else 1
    rows = [[marks[place].format(md(text)) for text, place in row] for _, row in _rows(made)]
    sides = ["left"] * left + ["right"] * (len(heads) - left)
    body = pd.DataFrame(rows, columns=heads).to_markdown(index=False, disable_numparse=True, colalign=sides)
    return "\n".join([md(made.caption), "", body, "", *(f"- {md(note)}" for note in _told(made))]) + "\n"


def md(text: str) -> str:
    """A text escaped so that Markdown shows it as it is.

    >>> md("a_b|<c>")
    'a\\\\_b\\\\|&lt;c&gt;'
    """
    line = " ".join(printable(text).split())
    line = line.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    return re.sub(r"([\\`*_\[\]|~$#])", r"\\\1", line)


_TEX = {
    "\\": r"\textbackslash{}",
    "{": r"\{",
    "}": r"\}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
    '"': r"\textquotedbl{}",
    "'": r"\textquotesingle{}",
    "`": r"\textasciigrave{}",
    "-": "{-}",
    "–": "--",
    "…": r"\ldots{}",
    "†": r"\textsuperscript{\textdagger}",
    "→": r"$\to$",
    **{mark: "\\" + mark for mark in "#$%&_"},
}


def tex(text: str) -> str:
    r"""A text escaped so that LaTeX sets it as it is, with the packages that `latex` names.

    What it cannot set becomes "?".

    >>> tex("a_b{50%}")
    'a\\_b\\{50\\%\\}'
    """
    return "".join(_TEX.get(c, c if c.isascii() or c.isalpha() else "?") for c in " ".join(printable(text).split()))


_PLAIN = {
    "styler.format.decimal": ".",
    "styler.format.escape": None,
    "styler.format.formatter": None,
    "styler.format.na_rep": None,
    "styler.format.thousands": None,
    "styler.latex.environment": None,
    "styler.render.max_columns": None,
    "styler.render.max_elements": 2**18,
    "styler.render.max_rows": None,
    "styler.sparse.columns": True,
    "styler.sparse.index": True,
}
"""What pandas' Styler is set to if its user has set nothing."""


def tabular(heads: Sequence[str], rows: Iterable[Sequence[str]], columns: str) -> str:
    """Heads and rows, LaTeX already, between the rules of booktabs, whatever the user has set."""
    settings: list[Any] = list(chain.from_iterable(_PLAIN.items()))
    with pd.option_context(*settings):
        body = pd.DataFrame(list(rows), columns=list(heads)).style.hide(axis="index")
        return str(body.to_latex(hrules=True, column_format=columns)).rstrip()


def latex(made: Sheet) -> str:
    """A floating table for ``\\usepackage{booktabs}`` and ``\\usepackage[T1]{fontenc}``, notes below it."""
    marks = {0: "{}", 1: r"\textbf{{{}}}", 2: r"\underline{{{}}}", NOT_RANKED: "{}" + tables.ASIDE}
    heads, left = _heads(made), 2 if made.has_scenes else 1
    rows: list[list[str]] = []
    for is_new, row in _rows(made):
        # a number is set in mathematics only where it has a sign
        cells = [marks[place].format(re.sub(r"^\{-\}(?=\d)", r"$-$", tex(text))) for text, place in row]
        if is_new and rows:
            cells[0] = rf"\midrule {cells[0]}"
        rows.append(cells)
    lines = [
        r"% needs \usepackage[T1]{fontenc}, \usepackage{textcomp} and \usepackage{booktabs}",
        r"\begin{table}",
        r"\centering\footnotesize",
        rf"\caption{{{tex(made.caption)}}}",
        rf"\label{{tab:{re.sub('[^A-Za-z0-9]+', '-', made.metric).strip('-')}}}",
        tabular(list(map(tex, heads)), rows, "l" * left + "r" * (len(heads) - left)),
        r"\par\smallskip",
    ]
    lines += [rf"\parbox{{\linewidth}}{{\footnotesize {tex(note)}}}\par" for note in _told(made)]
    return "\n".join([*lines, r"\end{table}"]) + "\n"
