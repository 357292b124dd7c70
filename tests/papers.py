"""A sheet of a made-up run."""

from matbench.reports import paper
from matbench.reports.content import Report


def made(report: Report, **options: object) -> paper.Sheet:
    return paper.sheet(report.results, report.cells, **options)  # type: ignore[arg-type]
