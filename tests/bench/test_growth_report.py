"""Growth in tables and pictures."""

from pathlib import Path

from attrs import evolve

from matbench.bench import growth, growth_report
from matbench.bench.roofline import Roofline


def test_growth_is_drawn_with_the_peer_and_the_ideal(tmp_path: Path) -> None:
    settings = sorted({s for axis in growth.AXES.values() for s in axis})
    points = []
    for name, power in (("okutomi_kanade", 1.0), ("sgbm", 1.2)):
        for setting in settings:
            point = growth.Point(name, setting, {"ssd_evaluations": 10})
            point.work = {"ssd_evaluations": point.cells}
            point.seconds, point.solves = 1e-9 * point.cells**power, 1
            points.append(point)
    found = growth.Growth(tuple(points), (), Roofline(10, 50), ())
    found = evolve(found, fits=tuple(growth._fits(found, found.methods)))
    text = growth_report.exponents(found).markdown() + growth_report.costs(found).markdown()
    assert "sgbm (peer)" in text
    assert "1.20 +- 0.00 (1.00)" in text
    written = growth_report.write_growth(found, tmp_path / "new")
    assert [path.name for path in written] == ["growth.csv", "growth.png", "growth.pdf"]
    assert all(path.stat().st_size > 500 for path in written)
    assert growth.chosen(["okutomi*"]) == ["okutomi_kanade", "sgbm"]
