"""What methods tell of their passes."""

import pytest
from attrs import evolve

from matbench.reports import page, passes, tables
from matbench.reports.content import Report


def test_energies_are_drawn_relative_to_their_first_pass(report: Report) -> None:
    scope = tables.shared(report.results, report.cells)
    assert passes.energies(report, scope) is None
    names = [("good", "", name, 0) for name in scope.asked]
    told = evolve(
        report, histories={names[0]: {"total": [4.0, 2.0, 1.0], "once": [3.0]}, names[1]: {"total": [8, None, 6]}}
    )
    figure = passes.energies(told, scope)
    assert figure is not None
    assert list(figure.axes[0].get_lines()[0].get_ydata()) == [100, 50, 25]
    assert passes.lines(told, scope) == [["good", "total", "2", "3", "-50.0"]]
    assert "No method told" in page.render(report)
    assert "No method told" not in page.render(told)


@pytest.mark.filterwarnings("error")
def test_numbers_of_any_size_are_no_warning_and_no_row_of_digits(report: Report) -> None:
    scope = tables.shared(report.results, report.cells)
    name = ("good", "", scope.asked[0], 0)

    def told(*numbers: float) -> Report:
        return evolve(report, histories={name: {"total": list(numbers)}})

    for numbers, shown in (
        ((1.7e308, 1.7e308), "+0.0"),
        ((1.0, 1.7e308), "–"),
        ((5e-324, 1.0), "–"),
        ((1.0, 1e20), "+1.0e+22"),
        ((1.0, -1.7e308, 0.5), "-50.0"),
    ):
        assert passes.lines(told(*numbers), scope)[0][-1] == shown
        figure = passes.energies(told(*numbers), scope)
        assert figure is not None
        figure.canvas.draw()
