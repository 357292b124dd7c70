"""What the README shows runs as it stands."""

import json
import re
import shlex
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import rerun as rr
from scene_files import Layers, write_png

from matbench import load_scene
from matbench.settings import Settings
from matbench.spec import Spec, parse

README = Path(__file__).parent.parent / "README.md"
if not README.exists():
    pytest.skip("no README beside the tests", allow_module_level=True)
TEXT = README.read_text()
CODE = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
TOML = re.findall(r"```toml\n(.*?)```", TEXT, re.DOTALL)[0]
LINES = re.findall(r"^    (matbench .*)$", TEXT, re.MULTILINE)


def matbench(line: str, folder: Path) -> subprocess.CompletedProcess[str]:
    tokens = [sys.executable, "-m", *shlex.split(line)]
    return subprocess.run(tokens, cwd=folder, capture_output=True, text=True, timeout=300)


def own_scene(folder: Path) -> None:
    """The folder that the README's scene.toml describes."""
    folder.mkdir()
    world = Layers(near=6, far=2)
    for view, name in enumerate(("left", "middle", "right")):
        write_png(folder / f"{name}.png", world.view(view - 1))
    write_png(folder / "middle_disparity.png", (world.truth() * 16).astype(np.uint8))
    (folder / "scene.toml").write_text(TOML)


def test_the_scene_of_your_own_is_what_it_says(tmp_path: Path) -> None:
    own_scene(tmp_path / "my_scene")
    for line in (line for line in LINES if line.startswith("matbench scene") and " new " not in line):
        done = matbench(line, tmp_path)
        assert done.returncode == 0, done.stdout + done.stderr
    assert (tmp_path / "scene-my_scene.png").exists()


def test_the_method_of_ten_lines_competes(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(CODE[0])
    line = next(line for line in LINES if "--plugin mine.py" in line)
    done = matbench(line.replace("synthetic/*", "synthetic/box[size=96x72]"), tmp_path)
    assert done.returncode == 0, done.stderr
    assert "mine[share=0.2]" in done.stdout


def test_the_python_code_runs(tmp_path: Path) -> None:
    (tmp_path / "script.py").write_text(CODE[1])
    line = [sys.executable, "script.py"]
    done = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert "okutomi_kanade" in done.stdout
    assert (tmp_path / "runs/two-methods/report.html").exists()


@pytest.mark.parametrize("line", [line for line in LINES if " ablate " in line])
def test_the_ablations_vary_something(line: str) -> None:
    from matbench import ablation, comparison, plan

    selector = shlex.split(line)[2]
    chosen, scenes = [selector], None
    if selector.endswith(".toml"):
        chosen, scenes = comparison.read_request(README.parent / selector)
        assert scenes
    ablation.check_varies(plan.methods(chosen), scenes or ())


@pytest.mark.parametrize("line", [line for line in LINES if "--data" in line and " ablate " not in line])
def test_the_lines_on_real_scenes_are_understood(line: str, data_root: Path, tmp_path: Path) -> None:
    from matbench import comparison

    tokens = shlex.split(line.replace("DIR", str(data_root)))
    scenes = [value for flag, value in pairwise(tokens) if flag == "-s"]
    ready = comparison.prepare(["sgbm"], scenes, settings=Settings(data_root), out=tmp_path / "run")
    assert len(ready.scenes) >= len(scenes)


def test_the_papers_setting_is_one_line(data_root: Path, tmp_path: Path) -> None:
    from matbench.algorithms.sampling import search_space

    (line,) = (line for line in LINES if "preset=paper" in line and "--row" in line)
    done = matbench(line.replace("DIR", str(data_root)), tmp_path)
    assert done.returncode == 0, done.stderr
    (facts,) = (json.loads(path.read_text()) for path in tmp_path.glob("runs/paper/cells/*/cell.json"))
    params = facts["cell"]["method"]["params"]
    scene = load_scene(facts["cell"]["scene"], data_root)
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


def small(selector: str) -> list[str]:
    """The same scenes, computed in small pictures."""
    size = {"size": "64x48"}
    return [str(Spec(s.name, s.options | size)) if s.name.startswith("synthetic/") else str(s) for s in parse(selector)]


@pytest.mark.parametrize("line", [line for line in LINES if "--data" not in line and "mine.py" not in line])
def test_the_other_lines_name_what_exists(line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from matbench import comparison, downloads

    tokens = shlex.split(line)
    if tokens[1] == "fetch":
        assert downloads.downloads(tokens[2:])[0]
        return
    if tokens[1] != "compare":
        assert tokens[1] in ("list", "scene", "view")
        return
    after = list(pairwise(tokens))
    monkeypatch.chdir(tmp_path)
    own_scene(tmp_path / "my_scene")
    chosen = [value for flag, value in after if flag == "-a"] or None
    scenes = [quick for flag, value in after if flag == "-s" for quick in small(value)] or None
    assert comparison.prepare(chosen, scenes, out=tmp_path / "run").plan.cells
