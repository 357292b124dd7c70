"""What the README and the guides tell people to write themselves works as it stands."""

import json
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import rerun as rr
from real import Real
from shown import CI_SCRIPT, GROUPS, LINES, METHOD, SCRIPT, TEXT

from matbench import load_scene


def matbench(line: str, folder: Path) -> subprocess.CompletedProcess[str]:
    tokens = [sys.executable, "-m", *shlex.split(line)]
    return subprocess.run(tokens, cwd=folder, capture_output=True, text=True, timeout=300)


def test_the_method_of_ten_lines_competes(tmp_path: Path) -> None:
    assert METHOD in TEXT["docs/guides/own-method.md"], "the README and the guide show the same method"
    (tmp_path / "mine.py").write_text(METHOD)
    line = next(line for line in LINES if "compare --plugin mine.py" in line)
    done = matbench(line.replace("synthetic/*", "synthetic/box[size=96x72]"), tmp_path)
    assert done.returncode == 0, done.stderr
    assert "mine[share=0.2]" in done.stdout


def test_the_guides_groups_do_what_it_says() -> None:
    names: dict[str, Any] = {}
    exec(GROUPS, names)  # noqa: S102 (what the guide shows)
    assert names["Mine"](share=0.2) == names["Mine"](guess=names["Guess"](0.2))
    with pytest.raises(ValueError, match="changes nothing") as error:
        names["Mine"](quick=True, share=0.2)
    assert f"`{error.value}`" in TEXT["docs/guides/own-method.md"]


def test_the_scripts_run(tmp_path: Path) -> None:
    for code in (SCRIPT, CI_SCRIPT):
        done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=300)
        assert done.returncode == 0, done.stderr
        if code is SCRIPT:
            assert "okutomi_kanade" in done.stdout
            assert (tmp_path / "runs/two-methods/report.html").exists()


def test_the_papers_setting_is_one_line(real: Real, tmp_path: Path) -> None:
    from matbench.algorithms.sampling import search_space

    (line,) = (line for line in LINES if "preset=paper" in line and "--row" in line)
    root = real("middlebury2001/tsukuba")
    done = matbench(line.replace("DIR", str(root)), tmp_path)
    assert done.returncode == 0, done.stderr
    (facts,) = (json.loads(path.read_text()) for path in tmp_path.glob("runs/paper/cells/*/cell.json"))
    params = facts["cell"]["method"]["params"]
    scene = load_scene(facts["cell"]["scene"], root)
    chosen = scene.choose(scene.widest(params["views"]))
    assert chosen.labels == ("col2", "col3", "col4", "col5")
    space = search_space(chosen, params["fineness"])
    assert (space.first, space.last) == (0, 21)
    assert facts["outcome"]["recorded"]["rows"] == [144]
    (path,) = tmp_path.glob("runs/paper/cells/*/recording.rrd")
    chunks = rr.chunk.RrdReader(path).stream()
    rows = {str(chunk.entity_path): chunk.to_record_batch().to_pylist()[0] for chunk in chunks}
    assert "Epipolar slices** of row 144:" in str(rows["/about"])
    # figure 2: the similarities of the pairs (0,1), (1,2), (2,3), the materialities and the derivative
    assert {f"/slices/144/{kind}" for kind in ("similarity", "visibility", "materiality", "derivative")} <= set(rows)
    volumes = [name.replace("\\", "") for name in rows if "volumes/similarity" in name]
    assert sorted(volumes) == [f"/volumes/similarity/col{k}-col{k + 1}" for k in (2, 3, 4)]
    (shape,) = (row["Tensor:data"][0]["shape"] for name, row in rows.items() if name == "/volumes/materiality")
    assert shape[1] == 22
