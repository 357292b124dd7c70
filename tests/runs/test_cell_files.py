"""The files of one cell: written, read back, and damaged."""

import json
from pathlib import Path

import numpy as np
import pytest
from compared import SMALL
from places import METHODS

from matbench import comparison
from matbench.plans.plan import Cell
from matbench.runs.cell_files import Solved, maps_digest, read_maps, read_volume, write_cell
from matbench.runs.outcome import Outcome


@pytest.fixture
def cell(tmp_path: Path) -> Cell:
    return comparison.prepare(["flat"], SMALL, out=tmp_path / "run", plugin=[METHODS], write=False).plan.cells[0]


MAPS = {2: np.arange(12, dtype=np.float32).reshape(3, 4), 0: np.full((3, 4), np.nan, np.float32)}


def test_a_cell_is_read_back_as_it_was_written(cell: Cell, tmp_path: Path) -> None:
    write_cell(tmp_path, cell, Outcome("ok", seconds=1.5), MAPS, log=b"said")
    facts = json.loads((tmp_path / "cell.json").read_text())
    assert facts["cell"]["key"] == cell.key
    assert facts["outcome"]["maps"] == maps_digest(MAPS)
    assert (tmp_path / "log.txt").read_bytes() == b"said"
    found = read_maps(tmp_path / "disparity.npz", (3, 4))
    assert maps_digest(found) == maps_digest(MAPS)
    assert read_volume(tmp_path, None) is None
    assert Solved(cell, Outcome("ok", has_volume=True), tmp_path).volume is None, "it should be there, and is not"


def test_a_link_where_a_file_is_to_be_written_is_not_followed(cell: Cell, tmp_path: Path) -> None:
    (tmp_path / "draft").mkdir()
    (tmp_path / "draft" / "log.txt").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(FileExistsError):
        write_cell(tmp_path / "draft", cell, Outcome("failed"), log=b"said")
    assert not (tmp_path / "elsewhere").exists()


def test_every_bit_and_every_view_counts_in_the_digest() -> None:
    digests = {maps_digest({view: values}) for view in (0, 2) for values in (MAPS[2], -MAPS[2], MAPS[2].T)}
    assert len(digests) == 6
    assert maps_digest(MAPS) == maps_digest(dict(sorted(MAPS.items())))


@pytest.mark.parametrize(
    ("arrays", "said"),
    [
        ({"view_0": MAPS[0], "view_1": MAPS[0][:2]}, "holds no disparity maps of one size"),
        ({"view_0": MAPS[0].astype(np.float64)}, "holds no disparity maps of one size"),
        ({"view_0": MAPS[0].T}, r"the map of view_0 in disparity.npz is \(4, 3\), not \(3, 4\)"),
        ({"left": MAPS[0]}, "invalid literal"),
    ],
)
def test_what_are_no_maps_is_refused(arrays: dict[str, np.ndarray], said: str, tmp_path: Path) -> None:
    np.savez(tmp_path / "disparity.npz", **arrays)
    with pytest.raises(ValueError, match=said):
        read_maps(tmp_path / "disparity.npz", (3, 4))
