"""Files of a figure: letters embedded, nothing in a name does anything."""

from pathlib import Path

import numpy as np
from figures import made
from latex import compile_latex

from matbench.reports import map_figure, paper_figure


def test_hostile_names_are_only_letters(tmp_path: Path) -> None:
    scene = made("made/$x$_^{\\a}%<b>", truth=False)
    drawn = map_figure.draw(
        map_figure.Maps((scene,), ("$m_1",), {("$m_1", scene.name): np.zeros((16, 24), np.float32)})
    )
    paths = paper_figure.write_figure(drawn, tmp_path / "f")
    assert [path.suffix for path in paths] == [".pdf", ".png", ".txt", ".tex"]
    assert r"\$m\_1" in paths[3].read_text()
    again = paper_figure.write_figure(drawn, tmp_path / "g")
    assert paths[0].read_bytes() == again[0].read_bytes()
    compile_latex(r"\input{f}", tmp_path)
