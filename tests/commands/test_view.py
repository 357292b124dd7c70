"""`matbench view`, and what may be recorded for it."""

from pathlib import Path

import pytest

from matbench.cli import main


@pytest.mark.parametrize(
    ("tokens", "said"),
    [
        (["compare", "--record", "slice", "-s", "synthetic/box"], "unknown part 'slice' of a recording: did you mean"),
        (["compare", "-s", "synthetic/box", "--record", "passes=x"], "passes 'x' is not a whole number from 0 to 200"),
        (["compare", "-s", "synthetic/box", "--record", "--rows", "5,"], "row '' is not a whole number"),
        (["compare", "-s", "synthetic/box", "--record", "--rows", "5,999"], "row 999 of synthetic/box: 0 to"),
        (["view", "x.rrd", "--compare", "a", "b"], "--compare takes two cells of a run"),
    ],
)
def test_wrong_choices_are_one_line(
    tokens: list[str], said: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as stop:
        main(tokens)
    err = capsys.readouterr().err
    assert (stop.value.code, err.count("\n")) == (2, 1)
    assert said in err
    assert list(tmp_path.iterdir()) == []
