"""Curves on the page, in a terminal and as a figure: the same numbers, and honest words."""

import re
from html import unescape
from itertools import combinations

import pandas as pd
import pytest
from attrs import evolve

from matbench.measures.statistics import FEW
from matbench.reports import curves, page, page_figures
from matbench.reports.content import Report
from matbench.results.sweeps import COLUMNS, Sweep

METHODS = (("good", ""), ("<b>&", "x=$1 y=_"))
VALUES = (0.0, 2.0, 4.5)
UNDECIDED = "undecided: about 23 scenes like these would decide it"


def sweep(scenes: int = 2, low: float = float("nan")) -> Sweep:
    rows = [
        (
            a,
            p,
            v,
            region,
            metric,
            "%",
            10 * i + v,
            low,
            low + 1,
            v,
            low,
            low + 2,
            scenes,
            "undecided" if v else "",
            23.0,
            100.0,
        )
        for i, (a, p) in enumerate(METHODS)
        for region in ("occ", "all", "nonocc", "mine")
        for metric in ("bad_1", "total_bad_1")
        for v in VALUES
    ]
    names = tuple(f"d/s{i}" for i in range(scenes))
    return Sweep("noise", "", "size=half", VALUES, names, ("d/lost",), ("mine", "gone"), {"good": 5}, _frame(rows))


def _frame(rows: list[tuple[object, ...]]) -> pd.DataFrame:
    return pd.DataFrame(rows, columns=list(COLUMNS))


def test_the_lines_are_those_of_one_metric_in_the_regions_order() -> None:
    lines = curves.lines(sweep())
    assert list(lines.columns) == ["region", "method", "0", "2", "4.5", "change", "interval", "scenes", "verdict"]
    assert lines.region.tolist() == ["nonocc", "nonocc", "all", "all", "occ", "occ", "mine", "mine"]
    assert lines.loc[1].tolist() == [
        "nonocc",
        "<b>&[x=$1 y=_]",
        "10.00",
        "12.00",
        "14.50",
        "+4.50",
        "–",
        "2",
        UNDECIDED,
    ]
    assert curves.lines(sweep(FEW, 1.0)).interval[0] == "+1.00 .. +3.00"


def test_the_caption_says_over_what_and_what_to_beware_of() -> None:
    said = curves.caption(sweep())
    for words in (
        "over the 2 scenes with every value: d/s0, d/s1.",
        "too few scenes for a band or a conclusion",
        "Left out for want of a result: d/lost.",
        "Not the same pixels at every value: mine.",
        "Held by a parameter noise of their own to: good 5.",
    ):
        assert words in said
    assert "too few" not in curves.caption(sweep(FEW, 1.0))
    assert "95 % over scenes" in curves.caption(sweep(FEW, 1.0))
    empty = evolve(sweep(), scenes=(), curves=_frame([]))
    assert curves.caption(empty).startswith("No scene has every value.")
    assert curves.figure(empty) is None


def test_the_title_names_option_range_and_setting() -> None:
    assert curves.title(sweep()) == "noise (grey levels), 0 to 4.5, scenes with size=half"
    assert curves.title(evolve(sweep(), of="m", setting="", option="window")) == "window of m, 0 to 4.5"


@pytest.mark.parametrize(("scenes", "low", "bands"), [(2, float("nan"), 0), (FEW, 1.0, 2)])
def test_the_figure_has_a_panel_per_region_a_curve_per_method_and_bands_where_scenes_suffice(
    scenes: int, low: float, bands: int
) -> None:
    figure = curves.figure(sweep(scenes, low))
    assert figure is not None
    panels = [axes for axes in figure.axes if axes.axison]
    assert [axes.get_title(loc="left") for axes in panels] == ["nonocc", "all", "occ", "mine"]
    for axes in panels:
        assert [list(line.get_ydata()) for line in axes.get_lines()] == [[0, 2, 4.5], [10, 12, 14.5]]
        assert len(axes.collections) == bands
        assert len({line.get_marker() for line in axes.get_lines()}) == 2, "without colour, too"
    text = page_figures.svg(figure)
    assert "&lt;b&gt;&amp;" in text
    assert "x=$1 y=_" in text


def test_many_curves_have_names_that_do_not_touch() -> None:
    rows = [
        (f"m{i}", "", v, "all", "total_bad_1", "%", 5 + i / 100, *[0.0] * 5, 2, "", None, 100.0)
        for i in range(7)
        for v in VALUES
    ]
    figure = curves.figure(evolve(sweep(), curves=_frame(rows)))
    assert figure is not None
    figure.draw_without_rendering()
    boxes = [text.get_window_extent() for text in figure.legends[0].get_texts()]
    assert len(boxes) == 7
    assert not any(one.overlaps(other) for one, other in combinations([*boxes, figure.axes[0].bbox], 2))
    styles = {(line.get_color(), line.get_marker(), line.get_linestyle()) for line in figure.axes[0].get_lines()}
    assert len(styles) == 7


def test_the_terminal_has_the_same_numbers() -> None:
    (table,) = curves.terminal([sweep()])
    assert str(table.title) == (
        "total_bad_1 (%) against noise (grey levels), 0 to 4.5, scenes with size=half, mean over 2 scenes; "
        "too few scenes to conclude"
    )
    assert [column.header.plain for column in table.columns] == [
        "region",
        "method",
        "0",
        "2",
        "4.5",
        "change",
        "scenes",
    ]
    assert [cell.plain for cell in table.columns[4].cells] == ["4.50", "14.50"] * 3
    assert curves.terminal([]) == []


def test_the_page_shows_figure_and_numbers_and_nothing_without_a_sweep(report: Report) -> None:
    assert 'id="curves"' not in page.render(report)
    html = page.render(evolve(report, sweeps=(sweep(), evolve(sweep(), option="n"))))
    section = html.partition('<div id="curves"')[2].partition('<section id="run"')[0]
    assert "<b>&[" not in section
    words = re.sub(r"\s+", " ", unescape(re.sub(r"<[^>]+>", "", section)))
    assert "number of views, 0 to 4.5, scenes with size=half" in words
    assert section.count(">14.50</td>") == 2 * 4, "two sweeps, four regions"
    assert section.count(">+4.50</td>") == 2 * 4 * 2, "two methods"
    assert section.count("<svg") == 2
