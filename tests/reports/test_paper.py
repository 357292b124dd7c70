"""The table of a run for a paper: every format says the same, and nothing in a name does anything."""

import csv
import io
import re
from pathlib import Path

import pandas as pd
import pytest
from latex import compile_latex

from matbench.reports import paper, run_tables, tables
from matbench.reports.content import Report
from matbench.reports.numbers import Numbers

AWKWARD = r"50% of_a\b {c}|d & $e$ #f ~g ^h *i* `j` <k> 'l' " + '"m" ä – 雪'


def made(report: Report, **options: object) -> paper.Sheet:
    return paper.sheet(report.results, report.cells, **options)  # type: ignore[arg-type]


def awkward(report: Report) -> Report:
    """The made-up run with one method called by all that LaTeX, Markdown and CSV read as marks."""
    for frame in (report.results, report.cells):
        frame["params"] = frame["params"].replace("", AWKWARD)
    return report


def from_csv(text: str) -> list[list[str]]:
    return [row[: row.index("total_bad_1")] for row in list(csv.reader(io.StringIO(text)))[1:]]


def from_md(text: str) -> list[list[str]]:
    rows = [line for line in text.splitlines() if line.startswith("| ")][1:]
    cells = [[c.strip() for c in re.split(r"(?<!\\)\|", row)[1:-1]] for row in rows]
    return [[re.sub(r"^(\*\*|<ins>)(.*?)(\*\*|</ins>)$", r"\2", c) for c in row] for row in cells]


def from_tex(text: str) -> list[list[str]]:
    body = text.partition(r"\midrule")[2].partition(r"\bottomrule")[0]
    rows = [row.replace(r"\midrule", "").strip() for row in re.split(r"\\\\\n", body)]
    cells = [[c.strip() for c in re.split(r"(?<!\\)&", row)] for row in rows if row]
    return [[re.sub(r"^\\(textbf|underline)\{(.*)\}$", r"\2", c) for c in row] for row in cells]


def test_all_formats_have_the_same_numbers_in_the_same_places(report: Report) -> None:
    sheet = made(awkward(report))
    found = {f: paper.formatted(sheet, f) for f in paper.FORMATS}
    rows = {"csv": from_csv(found["csv"]), "md": from_md(found["md"]), "tex": from_tex(found["tex"])}
    assert len(rows["csv"]) == 9, "three methods: their means and two scenes"
    numbers = {
        name: [[{"": "–", "--": "–"}.get(c, c) for c in row[2:]] for row in table] for name, table in rows.items()
    }
    assert numbers["csv"] == numbers["md"] == numbers["tex"]
    expected = sheet.texts.drop(columns=["scene", "method"]).to_numpy().tolist()
    assert numbers["csv"] == expected
    for name in ("csv", "md", "tex"):
        assert {len(row) for row in rows[name]} == {len(sheet.regions) + 3}, "no name breaks its row"
    # and they are those of the page's tables, as shown there
    scope = tables.shared(report.results, report.cells)
    for region in sheet.regions:
        means = tables.means(report.results, scope, region, "total_bad_1")
        shown = dict(zip(sheet.texts["method"][:3], sheet.texts[region][:3], strict=True))
        assert shown == {m: tables.text(v, "%") for m, v in means.items()}


def test_marks_stand_where_the_numbers_are_best(report: Report) -> None:
    sheet = made(report)
    md, tex = paper.markdown(sheet), paper.latex(sheet)
    # 10, 20 and 30 by construction; the third lacks a scene: its mean is not compared
    assert "**10.51**" in md
    assert "<ins>20.51</ins>" in md
    assert r"\textbf{10.51}" in tex
    assert r"\underline{20.51}" in tex
    assert not re.search(r"(\*\*|<ins>)30\.01[^|]*\|.*†", md)
    assert "†" in md
    assert sheet.texts.loc[0, "mean rank"] == "1.00"
    assert sheet.texts["mean rank"].tolist()[:3] == ["1.00", "2.00", "–"]


def test_mean_ranks_are_over_scenes_and_those_of_the_page() -> None:
    values = {("a", "s1"): (1, 5), ("b", "s1"): (2, 4), ("a", "s2"): (3.001, 1), ("b", "s2"): (3.002, 1)}
    rows = [
        (m, "", s, "v", 0, region, "total_bad_1", v, "%", 9)
        for (m, s), both in values.items()
        for region, v in zip(("all", "occ"), both, strict=True)
    ]
    columns = ["algorithm", "params", "scene", "view", "seed", "region", "metric", "value", "unit", "pixels"]
    results = pd.DataFrame(rows, columns=columns)
    cells = results[["algorithm", "params", "scene", "seed"]].drop_duplicates().assign(status="ok", seconds=1.0)
    sheet = paper.sheet(results, cells)
    assert "Mean rank: the place by total_bad_1 in all" in sheet.caption
    # in `all`, a is first in s1; in s2 what is shown alike shares 1.5
    assert sheet.texts.set_index(["scene", "method"])["mean rank"].to_dict() == {
        ("mean", "a"): "1.25",
        ("mean", "b"): "1.75",
        ("s1", "a"): "1.00",
        ("s1", "b"): "2.00",
        ("s2", "a"): "1.50",
        ("s2", "b"): "1.50",
    }
    labelled = Report("", "", tables.labelled(results), tables.labelled(cells))
    page = Numbers(labelled, tables.shared(results, cells))
    for region, chosen in (("all", ()), ("occ", ("occ",))):
        texts = paper.sheet(results, cells, regions=chosen, by_scene=False).texts.set_index("method")
        found = page.ranks["total_bad_1"][region]
        assert texts["mean rank"].to_dict() == {m: shown for m, (_, shown, _) in found.items()}
    higher = paper.sheet(results, cells, better="higher", regions=["all"])
    assert higher.texts["mean rank"][:2].tolist() == ["1.25", "1.75"]
    assert higher.texts["method"][0] == "b"


def test_failed_cells_are_in_the_notes_of_every_format(report: Report) -> None:
    sheet = made(report)
    for text in (paper.markdown(sheet), paper.latex(sheet)):
        assert "failed (ValueError: " in text.replace("\\", "")
        assert "too few to conclude" in text
        assert "not ranked: mean over 1 of 2 scenes" in text
    assert "not ranked: mean over 1 of 2 scenes" in paper.comma_separated(sheet)


def test_markdown_shows_marks_and_runs_none() -> None:
    shown = paper.md(AWKWARD)
    assert "<k>" not in shown
    assert not re.search(r"(?<!\\)[|*_`$#~]", shown)
    assert paper.md("a\nb\x00") == r"a b\\x00"


def test_latex_is_balanced_whatever_the_names(report: Report) -> None:
    text = paper.latex(made(awkward(report)))
    plain = re.sub(r"\\[\\{}%&#$_]", "", text)
    assert plain.count("{") == plain.count("}")
    lines = [line for line in plain.splitlines() if not line.startswith("%")]
    assert not re.search(r"[#~^%]", "\n".join(lines))
    assert text.count(r"\begin{") == text.count(r"\end{") == 2
    assert paper.tex("\x07") == r"\textbackslash{}x07"


def test_latex_compiles(report: Report, tmp_path: Path) -> None:
    # only other engines set the last letter
    compile_latex(paper.latex(made(awkward(report))).replace("雪", "?"), tmp_path)


@pytest.fixture
def run(report: Report, tmp_path: Path) -> Path:
    """A run folder without plan, cells and scenes: its tables are enough."""
    report.results.to_csv(tmp_path / "results.csv", index=False)
    report.cells.to_csv(tmp_path / "cells.csv", index=False)
    return tmp_path


def test_tables_read_back_give_the_same_sheet(report: Report, run: Path) -> None:
    pd.testing.assert_frame_equal(paper.sheet(*run_tables.read_run(run)).texts, made(report).texts)
