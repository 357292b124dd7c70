"""Figures look the same whatever settings their user has, and the user keeps these settings."""

import logging
import os
import subprocess
import sys
from pathlib import Path

import matplotlib as mpl
import pytest
from places import TESTS

from matbench.drawing import load, style

MATPLOTLIBRC = """
text.usetex: True
savefig.bbox: tight
savefig.format: jpg
savefig.dpi: 30
savefig.transparent: True
figure.dpi: 37
figure.autolayout: True
font.size: 23
font.family: monospace
svg.fonttype: path
pdf.compression: 0
pdf.fonttype: 3
axes.grid: True
axes.facecolor: red
axes.xmargin: 0.4
axes.prop_cycle: cycler('color', ['y', 'm'])
lines.linewidth: 9
path.sketch: 1, 100, 2
image.cmap: jet
image.interpolation: bicubic
legend.fontsize: 30
no.such.setting: 1
"""

DRAWN = """
import sys
from pathlib import Path
if sys.argv[1] == "hostile":
    import cv2, numpy as np, pandas as pd
    np.seterr(all="raise")
    np.set_printoptions(precision=1, threshold=2)
    cv2.setNumThreads(0)
    for name, value in {
        "display.precision": 1, "display.max_rows": 2, "display.max_columns": 2, "display.max_colwidth": 5,
        "display.float_format": "{:.0f}".format, "styler.format.escape": "latex", "styler.format.na_rep": "?",
        "styler.latex.environment": "longtable", "styler.format.decimal": ",", "styler.sparse.index": False,
    }.items():
        pd.set_option(name, value)
from attrs import evolve
from made_up import made_up
from test_switches import table
from figures import made
from matbench.reports import contact_sheet, map_figure, page, paper, paper_figure, switches
report = evolve(made_up(), ablation=table())
folder = Path(sys.argv[2])
(folder / "page.html").write_text(page.render(report))
(folder / "ablation.tex").write_text(switches.latex(table()))
sheet = paper.sheet(report.results, report.cells, "total_bad_1", "lower", (), True)
for name in paper.FORMATS:
    (folder / f"table.{name}").write_text(paper.formatted(sheet, name))
scene = made("made/one")
(folder / "sheet.png").write_bytes(contact_sheet.contact_sheet(scene))
drawn = map_figure.draw(map_figure.Maps((scene,), ("mine",), {("mine", scene.name): scene.truth[0]}))
paper_figure.write_figure(drawn, folder / "maps")
"""


def draw(tmp_path: Path, kind: str, cwd: Path, **settings: str) -> dict[str, bytes]:
    """Name -> content of everything that is drawn, by a process with these settings; it says nothing."""
    place = tmp_path / kind
    place.mkdir()
    paths = os.pathsep.join(str(one) for one in (TESTS, TESTS / "reports"))
    env = {**os.environ, "PYTHONPATH": paths, **settings}
    line = [sys.executable, "-c", DRAWN, kind, str(place)]
    done = subprocess.run(line, env=env, cwd=cwd, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return {path.name: path.read_bytes() for path in place.iterdir()}


def test_everything_is_drawn_byte_for_byte_alike(tmp_path: Path) -> None:
    (tmp_path / "matplotlibrc").write_text(MATPLOTLIBRC)
    usual = draw(tmp_path, "usual", TESTS, MPLBACKEND="")
    inline = "module://matplotlib_inline.backend_inline"
    hostile = draw(tmp_path, "hostile", tmp_path, MPLBACKEND=inline)
    assert len(usual) == 10
    assert [name for name in usual if hostile[name] != usual[name]] == []


def test_a_backend_that_is_none_is_no_reason_not_to_draw(tmp_path: Path) -> None:
    code = "from matbench.drawing import load; import os; print(load().__name__, os.environ['MPLBACKEND'])"
    env = {**os.environ, "MPLBACKEND": "no such backend"}
    done = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, timeout=300)
    assert (done.stdout, done.stderr) == ("matplotlib no such backend\n", "")


def test_settings_that_cannot_be_read_are_told_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "matplotlibrc").write_bytes(b"font.size: \xff\xfe\n")
    line = [sys.executable, "-m", "matbench", "scene", "show", "synthetic/box[size=48x36]"]
    done = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert done.returncode == 2
    assert done.stderr.startswith("matbench: matplotlib cannot be imported with its settings: UnicodeDecodeError: ")
    assert done.stderr.count("\n") == 1


def test_without_a_home_nothing_is_said(tmp_path: Path) -> None:
    code = "from matbench.drawing import load; load()"
    env = {"PATH": os.defpath, "HOME": "/proc"}
    done = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, timeout=300)
    assert (done.returncode, done.stderr) == (0, "")


def test_the_users_settings_hold_before_and_after() -> None:
    log = logging.getLogger("matplotlib")
    with mpl.rc_context({"font.size": 23, "axes.grid": True}):
        before, level = dict.copy(mpl.rcParams), log.level
        with style({"font.size": 7}):
            assert (mpl.rcParams["font.size"], mpl.rcParams["axes.grid"]) == (7, False)
            with style():
                assert mpl.rcParams["font.size"] == 10
            assert mpl.rcParams["font.size"] == 7
        assert dict.copy(mpl.rcParams) == before
        assert log.level == level
    with pytest.raises(KeyError, match=r"font\.sise"), style({"font.sise": 7}):
        raise AssertionError("never reached")


def test_it_is_the_module_that_others_import() -> None:
    assert load() is mpl
