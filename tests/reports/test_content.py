"""What a page shows of a run, as one value."""

import numpy as np
from attrs import evolve

from matbench.reports.content import Report


def test_a_map_is_found_by_its_cell_however_maps_are_given(report: Report) -> None:
    asked: list[tuple[str, str, str, int]] = []

    def read(*key):
        asked.append(key)
        return report.maps.get(key)  # type: ignore[union-attr]

    lazy = evolve(report, maps=read)
    assert not asked, "nothing is read before it is asked for"
    for key, values in report.maps.items():  # type: ignore[union-attr]
        for one in (report, lazy):
            np.testing.assert_array_equal(one.disparity(*key), values)
    assert len(asked) == len(report.maps) > 0  # type: ignore[arg-type]
    assert report.disparity("nobody", "", "made/one", 0) is None
    assert lazy.disparity("good", "", "made/one", 99) is None


def test_a_map_of_another_size_or_of_an_unknown_scene_is_none(report: Report) -> None:
    key = ("good", "", "made/one", 0)
    assert report.disparity(*key) is not None
    wrong = evolve(report, maps={**report.maps, key: np.zeros((3, 3), np.float32)})  # type: ignore[dict-item]
    assert wrong.disparity(*key) is None
    assert evolve(report, scenes={}).disparity(*key) is None


def test_what_is_not_said_is_not_there(report: Report) -> None:
    bare = Report("a run", "matbench compare", report.results, report.cells)
    assert bare.volumes("good", "", "made/one", 0) is None
    assert bare.disparity("good", "", "made/one", 0) is None
    assert (bare.sweeps, bare.ablation, bare.reliability) == ((), None, None)
