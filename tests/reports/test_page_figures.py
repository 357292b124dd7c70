"""Figures of the page."""

from matbench.reports import page_figures, tables
from matbench.reports.content import Report


def test_the_figure_takes_names_literally(report: Report) -> None:
    rows = tables.summary(report.results, report.cells)
    rows.index = ["$x^$ \x07", "<b>&", "c"]
    figure = page_figures.cost(rows, "total_bad_1 all", "%")
    assert figure is not None
    text = page_figures.svg(figure)
    assert r"$x^$ \x07" in text
    assert "&lt;b&gt;&amp;" in text
    assert page_figures.cost(rows.assign(ranked=False), "total_bad_1 all", "%") is None
