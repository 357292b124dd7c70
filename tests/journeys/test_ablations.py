"""The ablations that come with the methods: their files are read, their methods can be built and do vary."""

from pathlib import Path

import pytest
from tools import need

import matbench.algorithms
from matbench.comparison import prepare
from matbench.plans.plan import methods
from matbench.plans.request import read_request
from matbench.results import ablation

FILES = sorted((Path(matbench.algorithms.__file__).parent / "ablations").glob("*.toml"))


def test_there_are_some() -> None:
    assert {"pairs", "binarization", "relatives", "pair_sets", "visibility"} <= {file.stem for file in FILES}


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_an_ablation_can_be_asked_for(file: Path) -> None:
    algorithms, scenes = read_request(file)
    if any("mccnn" in one for one in algorithms):
        need("mccnn")
    ablation.check_varies(methods(algorithms, ()), scenes or ())
    ready = prepare(algorithms, "synthetic/box", write=False)
    assert len(ready.plan.cells) >= 2, "parameters that nothing reads would be refused"
    assert len({cell.key for cell in ready.plan.cells}) == len(ready.plan.cells)
