"""The pictures of a page, within its size."""

import numpy as np
from attrs import evolve
from pictures_read import read

from matbench.reports import pictures, tables
from matbench.reports.content import Report
from matbench.reports.encoding import LEAST_SIDE


def test_pictures_that_do_not_compress_are_drawn_smaller_until_the_page_holds_them(report: Report) -> None:
    template, random = next(iter(report.scenes.values())), np.random.default_rng(0)
    views = random.integers(0, 255, (3, 150, 200, 3), dtype=np.uint8)
    truth = random.uniform(0, 5, (150, 200)).astype(np.float32)
    noisy = evolve(template, views=views, truth={1: truth}, regions={"all": np.isfinite(truth)})
    maps = {key: random.uniform(0, 5, (150, 200)).astype(np.float32) for key in report.maps}
    made = evolve(
        report, maps=maps, scenes=dict.fromkeys(report.scenes, noisy), results=tables.labelled(report.results)
    )
    made = evolve(made, cells=tables.labelled(report.cells))
    scope = tables.shared(made.results, made.cells)
    whole = pictures.gallery(made, scope)
    assert whole.scenes[0]["shown"] == (200, 150)
    fitting = pictures.gallery(made, scope, whole.characters // 3)
    assert whole.characters / 5 < fitting.characters <= whole.characters // 3
    columns, rows = fitting.scenes[0]["shown"]
    assert read(fitting.scenes[0]["methods"][0]["map"]).shape == (2 * rows, columns)
    assert fitting.spreads.keys() == whole.spreads.keys()
    least = pictures.gallery(made, scope, 1)
    assert least.scenes[0]["shown"] == (LEAST_SIDE, 48), "not smaller than can be seen"
