"""What changes decides what is done again."""

import importlib
import shutil
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from resuming import PLUGIN
from scene_files import Layers, write_png

from matbench import comparison
from matbench.errors import UserError
from matbench.plans import plugins
from matbench.rescoring import open_run
from matbench.results import freshness, metric_catalogue
from matbench.results.status import standing
from matbench.runs.todo import explained


def test_what_changes_decides_what_is_done_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Methods' code and pixels: the cell. Truth and metrics: the scores. Other plug-ins' code: nothing."""
    scene, layers = tmp_path / "scene", Layers(width=72, height=40)
    scene.mkdir()
    for view in range(3):
        write_png(scene / f"v{view}.png", layers.view(view - 1))
    write_png(scene / "truth.png", np.round((layers.truth() + 2) * 16).astype(np.uint8))
    (scene / "scene.toml").write_text(
        'views = ["v0.png", "v1.png", "v2.png"]\ndisparities = [-2, 3]\nreference = "v1.png"\npair_steps = 1\n'
        '[truth."v1.png"]\nfile = "truth.png"\nscale = 16\nunknown = 0\n'
    )
    mine, other = tmp_path / "mine.py", tmp_path / "other.py"
    mine.write_text(PLUGIN)
    other.write_text(PLUGIN.replace("Steady", "Strange").replace("Seeded", "Sown"))
    site = tmp_path / "site"  # a package with a metric, as if it were installed
    (site / "extra-1.0.dist-info").mkdir(parents=True)
    (site / "extra-1.0.dist-info" / "METADATA").write_text("Metadata-Version: 2.1\nName: extra\nVersion: 1.0\n")
    (site / "extra-1.0.dist-info" / "entry_points.txt").write_text("[matbench.metrics]\nmean = extra:METRIC\n")
    monkeypatch.syspath_prepend(site)
    run = tmp_path / "run"

    def measure(factor: int) -> None:
        """Another version of that package; all that a new process would find out is forgotten."""
        (site / "extra.py").write_text(
            "from matbench.measures.metrics import Metric\n"
            f"METRIC = Metric('mine', 'px', 'lower', 'a measure of mine', lambda e: {factor}.0 * float(e.mean()))\n"
        )
        forget()

    def forget() -> None:
        sys.modules.pop("extra", None)
        importlib.invalidate_caches()
        shutil.rmtree(site / "__pycache__", ignore_errors=True)
        for cached in (plugins.installed, plugins.code_digest, metric_catalogue._installed, freshness.digest):
            cached.cache_clear()

    def prepared(write: bool = False) -> comparison.Comparison:
        names = ["steady", "seeded", "strange"]
        return comparison.prepare(names, str(scene), out=run, plugin=[mine, other], write=write)

    def why() -> list[str]:
        ready = prepared()
        return [f"{cell.method}: {why}" for cell, why in explained(ready.plan, ready.store, ready.settings)]

    def mean(name: str, table: pd.DataFrame) -> float:
        one = (table.metric == name) & (table.region == "all") & (table.algorithm == "steady")
        return float(table[one].value.item())

    measure(1)
    try:
        ready = prepared(write=True)
        ready.run()
        first = ready.tables().results
        assert mean("mine", first) == pytest.approx(mean("avg", first))
        cells = {path: path.stat().st_mtime_ns for path in run.glob("cells/*/cell.json")}
        assert len(cells) == 3
        assert standing(run).tables == ""

        measure(10)  # another scorer
        assert "they were made by another scorer" in standing(run).tables
        write_png(scene / "truth.png", np.round((layers.truth() + 3) * 16).astype(np.uint8))  # another truth
        assert why() == []
        again, left_out = open_run(run)
        assert not left_out
        second = again.tables().results
        assert mean("mine", second) == pytest.approx(10 * mean("avg", second))
        assert mean("avg", second) != pytest.approx(mean("avg", first))
        assert standing(run).tables == ""

        other.write_text(other.read_text() + "\nLONGER = 1\n")
        assert why() == ["strange: code changed"]
        assert {path: path.stat().st_mtime_ns for path in run.glob("cells/*/cell.json")} == cells

        picture = layers.view(0)
        picture[0, 0, 0] ^= 1
        write_png(scene / "v1.png", picture)  # one bit of one pixel
        assert why() == ["steady: scene changed", "seeded: scene changed", "strange: code and scene changed"]
        with pytest.raises(UserError, match="its pixels, views or range have changed"):
            open_run(run)
    finally:
        monkeypatch.undo()
        forget()


def test_one_changed_scene_file_is_that_scene_s_cells_only(tmp_path: Path) -> None:
    for seed, name in enumerate(("one", "two")):
        layers = Layers(width=48, height=32, seed=seed)
        (tmp_path / name).mkdir()
        for view in range(3):
            write_png(tmp_path / name / f"v{view}.png", layers.view(view - 1))
        write_png(tmp_path / name / "truth.png", np.round((layers.truth() + 2) * 16).astype(np.uint8))
        (tmp_path / name / "scene.toml").write_text(
            'views = ["v0.png", "v1.png", "v2.png"]\ndisparities = [-2, 3]\nreference = "v1.png"\npair_steps = 1\n'
            '[truth."v1.png"]\nfile = "truth.png"\nscale = 16\nunknown = 0\n'
        )
    scenes, run = [str(tmp_path / name) for name in ("one", "two")], tmp_path / "run"
    ready = comparison.prepare(["sgbm", "okutomi_kanade"], scenes, out=run)
    ready.run()
    stamps = {path: path.stat().st_mtime_ns for path in run.glob("cells/*/cell.json")}
    assert len(stamps) == 4
    picture = Layers(width=48, height=32, seed=1).view(1)
    picture[5, 5] ^= 255
    write_png(tmp_path / "two" / "v2.png", picture)
    again = comparison.prepare(["sgbm", "okutomi_kanade"], scenes, out=run)
    due = again.pending().cells
    assert [str(cell).endswith("/two") for cell in due] == [True, True]
    again.run()
    assert {path: path.stat().st_mtime_ns for path in stamps if path.exists()} == stamps
    assert len(list(run.glob("cells/*/cell.json"))) == 6
