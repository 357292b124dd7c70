"""One more solve of a cell, of which all that the method tells is kept."""

from pathlib import Path

import numpy as np
import pytest
from places import METHODS
from typing_commands import SMALL

from matbench import comparison
from matbench.errors import UserError
from matbench.plans.record_option import RecordOption
from matbench.solving.captured_solve import solve_captured

TELLS = """
import numpy as np
from matbench import DisparitySpace, Estimate, Volume

class Tells:
    def solve(self, scene, context):
        space = DisparitySpace.covering(scene.disparities, scene.n, scene.height, scene.width)
        for step in range(3):
            values = np.full(space.shape, step / 2, np.float32)
            volume = Volume(space, values, tuple(range(scene.n)))
            context.probe.iteration(step, {"total": 9.0 - step}, volume)
        seen = float(len(scene.truth))
        return Estimate({scene.ref: np.full((scene.height, scene.width), seen, np.float32)}, volume)
"""


def test_what_a_method_tells_is_kept_and_it_has_no_truth(tmp_path: Path) -> None:
    plugin = tmp_path / "tells.py"
    plugin.write_text(TELLS)
    ready = comparison.prepare("tells", SMALL, out=tmp_path / "run", plugin=plugin)
    (cell,), scene = ready.plan.cells, ready.scenes[SMALL]
    found = solve_captured(cell, [plugin], scene, RecordOption(rows=(9,)))
    assert found.probe.energies == {"total": [(0, 9.0), (1, 8.0), (2, 7.0)]}
    assert [frame.step for frame in found.probe.frames] == [0, 1, 2]
    assert [int(frame.materiality.max()) for frame in found.probe.frames if frame.materiality is not None] == [
        0,
        128,
        255,
    ]
    assert set(np.unique(found.estimate.disparity[scene.ref])) == {0}, "no map of truth was there"
    assert found.estimate.volume is not None
    assert (found.estimate.volume.values == 1).all()


def test_what_goes_wrong_is_one_line_that_names_the_cell(tmp_path: Path) -> None:
    names = {
        "raises": "failed: ArithmeticError: the third digit is missing and more",
        "declines": "was skipped: only scenes with a hundred views",
        "exits": "failed: the method ended its process (exit status 7)",
        "bare": "failed: TypeError: solve returned ndarray",
    }
    ready = comparison.prepare(list(names), SMALL, out=tmp_path / "run", plugin=METHODS)
    for cell, said in zip(ready.plan.cells, names.values(), strict=True):
        with pytest.raises(UserError) as error:
            solve_captured(cell, [METHODS], ready.scenes[SMALL], RecordOption())
        assert str(error.value).startswith(f"{cell} {said}")
        assert "\n" not in str(error.value)
