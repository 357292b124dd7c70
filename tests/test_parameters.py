"""A user's own method whose parameters stand in a group: typed flat, ablated, stored, shown by group."""

import json
from pathlib import Path

import pandas as pd
import pytest
from attrs import field, frozen, validators

from matbench.cli import main
from matbench.errors import UserError
from matbench.parameters import build

MINE = '''
import numpy as np
from attrs import field, frozen
from matbench import Context, Estimate, Scene

@frozen
class Guess:
    share: float = 0.5
    steps: int = 1

@frozen
class Mine:
    """A flat guess."""

    guess: Guess = field(factory=Guess)
    blind: bool = False

    @property
    def silent(self):
        return {"share": "blind=false"} if self.blind else {}

    def solve(self, scene: Scene, context: Context) -> Estimate:
        share = 0 if self.blind else self.guess.share
        flat = np.full((scene.height, scene.width), share * scene.disparities.largest, np.float32)
        return Estimate({scene.ref: flat})
'''
SCENE = "synthetic/box[size=64x48]"


def run(capsys: pytest.CaptureFixture[str], *tokens: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as stop:
        main(list(tokens))
    said = capsys.readouterr()
    return int(stop.value.code or 0), said.out, said.err


def test_a_plug_in_with_a_group(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.py").write_text(MINE)
    plugin = ("--plugin", "mine.py")
    _, out, _ = run(capsys, "list", "--json", *plugin)
    assert json.loads(out)["algorithms"]["mine"]["parameters"] == {
        "share": {"type": "a number", "default": 0.5, "group": "guess"},
        "steps": {"type": "a whole number", "default": 1, "group": "guess"},
        "blind": {"type": "true or false", "default": False},
    }

    line = ("ablate", "mine[share=0.2,0.9]", "-s", SCENE, "--out", "run", *plugin)
    assert run(capsys, *line)[0] == 0
    change = pd.read_csv("run/ablation.csv")
    assert set(zip(change["factor"], change["base"], change["level"], strict=True)) == {("share", 0.2, 0.9)}
    assert (change["change"] != 0).any()

    def written() -> dict[Path, int]:
        return {path: path.stat().st_mtime_ns for path in Path("run").glob("cells/*/*")}

    before = written()
    assert run(capsys, *line)[0] == 0
    assert len(before) >= 2
    assert written() == before, "what is stored is found again"
    assert run(capsys, "score", "run")[0] == 0

    status, _, err = run(capsys, "ablate", "mine[blind=true share=0.2,0.9]", "-s", SCENE, *plugin)
    assert (status, err) == (2, "matbench: mine: share=0.2 changes nothing here: it takes blind=false\n")


def test_a_refused_number_is_told_without_the_words_of_attrs() -> None:
    @frozen
    class Sign:
        sign: int = field(default=1, validator=validators.in_((1, -1)))

    with pytest.raises(UserError) as told:
        build("m", Sign, {"sign": 2})
    assert str(told.value) == "m: 'sign' must be in (1, -1) (got 2)"
