"""Two states of the code, compared in pairs of processes."""

from collections.abc import Sequence
from pathlib import Path

import pytest

from matbench.bench import base
from matbench.bench.measuring import Tree
from matbench.bench.turns import Turns


def test_pairs_of_processes_give_a_ratio_with_an_interval() -> None:
    slower = [Turns(ratio) for ratio in (1.3, 1.27, 1.34, 1.31)]
    found = base.versus("one", slower)
    assert found.low < found.ratio < found.high
    assert found.ratio == pytest.approx(1.305, abs=0.01)
    assert found.verdict(0.15) == "slower"
    assert found.verdict(0.4) == "same"
    assert base.versus("one", [Turns(1 / one.ratio) for one in slower]).verdict(0.15) == "faster"
    assert base.versus("one", [Turns(ratio) for ratio in (0.8, 1.6, 0.9, 1.5)]).verdict(0.15) == "unsure"
    gone = base.versus("one", [*slower, Turns(reason="not in the base: AttributeError: none")])
    assert gone.verdict(0.15) == "not compared"
    assert gone.reason == "not in the base: AttributeError: none"


def test_what_is_unsure_is_measured_in_as_many_pairs_again(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    asked: list[Sequence[str]] = []

    def pair(_: Tree, __: Tree, names: Sequence[str], ___: int, number: int) -> dict[str, Turns]:
        asked.append(list(names))
        disturbed = 0.8 if number == 1 else 1.3
        return {"calm": Turns(1.0 + number / 1000), "disturbed": Turns(disturbed), "gone": Turns(reason="no")}

    monkeypatch.setattr(base, "in_turns", pair)
    tree = Tree(tmp_path, tmp_path, tmp_path)
    found = base.compare(tree, tree, ["calm", "disturbed", "gone"], 0.15, pairs=4, progress=lambda _: None)
    assert [one.verdict(0.15) for one in found] == ["same", "slower", "not compared"]
    assert asked[:4] == [["calm", "disturbed", "gone"]] * 4
    assert asked[4:] == [["disturbed"]] * 4
