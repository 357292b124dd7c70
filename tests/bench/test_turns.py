"""Two states of the code, measured in turns."""

import sys
from pathlib import Path

import numpy as np
import prove
import pytest
from attrs import evolve
from places import ROOT

from matbench.bench.measuring import Tree
from matbench.bench.turns import in_turns
from matbench.errors import UserError


def test_a_side_that_fails_is_told_with_its_reason(tmp_path: Path) -> None:
    here, cache = ROOT, tmp_path / "kernels"
    whole = Tree(here, Path(sys.executable), cache)
    code = prove.copy_checkout(tmp_path / "code")
    (code / "matbench" / "algorithms" / "semiglobal.py").write_text('raise SystemExit("broken off")\n')
    (code / "matbench" / "algorithms" / "sgbm.py").write_text("SGBM = None\n")
    found = in_turns(whole, Tree(code, whole.python, tmp_path / "others"), ["sgbm", "winner", "voxel pooling"], 3)
    assert found["sgbm"].reason.startswith("not in the base: UserError: None is no method")
    assert found["winner"].reason == "not in the base: SystemExit: broken off"
    assert found["voxel pooling"].ratio > 0, "a subject that fails costs no other"
    assert np.isnan(found["winner"].ratio)
    with pytest.raises(UserError, match="was measured instead of"):
        in_turns(evolve(whole, code=tmp_path), whole, ["sgbm"], 3, tests=here)
