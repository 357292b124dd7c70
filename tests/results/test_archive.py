"""Runs as archives: whole, the same bytes every time, checked, and harmless to whoever opens them."""

import json
import os
import subprocess
import sys
import zipfile
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path

import pandas as pd
import pytest
from places import METHODS

from matbench import comparison
from matbench.cli import main
from matbench.errors import UserError
from matbench.rescoring import join, open_run
from matbench.results.archive import export, unpack
from matbench.runs.lock import locked
from matbench.runs.store import Store

SMALL = "synthetic/box[size=48x36]"


def run(capsys: pytest.CaptureFixture[str], *tokens: object) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as stop:
        main([str(token) for token in tokens])
    said = capsys.readouterr()
    return int(stop.value.code or 0), said.out, said.err


def done(folder: Path, *algorithms: str, scene: str = SMALL, plugin: Path = METHODS) -> Path:
    ready = comparison.prepare(list(algorithms), scene, out=folder, plugin=plugin, command="typed")
    with locked(folder):
        ready.run()
        ready.tables()
    return folder


def test_an_archive_checks_itself_anywhere(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = done(tmp_path / "run", "flat", "noise", "raises")
    archive, left = export(folder)
    assert (archive, left) == (tmp_path / "run.zip", 0)
    content = archive.read_bytes()
    for path in folder.rglob("*"):
        os.utime(path, (1e9, 1e9))
    assert export(folder)[0].read_bytes() == content, "the same run, the same bytes"
    with zipfile.ZipFile(archive) as opened:
        names = set(opened.namelist())
        manifest = json.loads(opened.read("manifest.json"))["files"]
        assert set(manifest) | {"manifest.json"} == names
        assert all(sha256(opened.read(name)).hexdigest() == manifest[name]["sha256"] for name in manifest)
    assert {"plan.json", "results.csv", "cells.csv", "scores.json"} < names
    assert sum(name.endswith("disparity.npz") for name in names) == 2

    status, out, err = run(capsys, "score", archive)
    assert status == 0, err
    assert "every file is what it was when the run was exported" in out
    assert "the scores are what they were, byte for byte" in out
    assert archive.read_bytes() == content
    status, out, err = run(capsys, "score", archive, "--out", tmp_path / "taken")
    assert status == 0, err
    assert (tmp_path / "taken" / "results.csv").read_bytes() == (folder / "results.csv").read_bytes()
    assert (tmp_path / "taken" / "report.html").exists()

    forged = _changed(archive, tmp_path / "forged.zip", {"results.csv": _better})
    status, _, err = run(capsys, "score", forged)
    assert status == 2
    assert "results.csv is not what it was when the run was exported" in err
    forged = _changed(archive, tmp_path / "forged.zip", {"results.csv": _better}, honest_manifest=True)
    status, out, err = run(capsys, "score", forged)
    assert status == 1, err
    assert "scores are not what they were" in out


def _better(content: bytes) -> bytes:
    lines = content.decode().splitlines(keepends=True)
    value = lines[1].split(",")[lines[0].split(",").index("value")]
    return "".join([lines[0], lines[1].replace(value, "0.5"), *lines[2:]]).encode()


def _changed(
    archive: Path, target: Path, change: dict[str, Callable[[bytes], bytes]], honest_manifest: bool = False
) -> Path:
    with zipfile.ZipFile(archive) as old, zipfile.ZipFile(target, "w") as new:
        files = {name: change.get(name, lambda content: content)(old.read(name)) for name in old.namelist()}
        if honest_manifest:
            manifest = json.loads(files["manifest.json"])
            for name in change:
                manifest["files"][name]["sha256"] = sha256(files[name]).hexdigest()
            files["manifest.json"] = json.dumps(manifest).encode()
        for name, content in files.items():
            new.writestr(name, content)
    return target


def _link(archive: zipfile.ZipFile) -> None:
    info = zipfile.ZipInfo("cells/0123456789abcdef/log.txt")
    info.create_system, info.external_attr = 3, 0o120777 << 16
    archive.writestr(info, "/etc/passwd")


@pytest.mark.parametrize(
    ("add", "said"),
    [
        (lambda z: z.writestr("../evil.txt", "x"), "'../evil.txt', which is no file of an exported run"),
        (lambda z: z.writestr("/evil.txt", "x"), "'/evil.txt', which is no file"),
        (lambda z: z.writestr("cells/../plan.json", "x"), "'cells/../plan.json', which is no file"),
        (lambda z: z.writestr("cells/0123456789abcdef/x/cell.json", "x"), "which is no file"),
        (lambda z: z.writestr("cells/0123456789abcdef/plan.json", "x"), "which is no file"),
        (lambda z: z.writestr("evil.py", "x"), "'evil.py', which is no file"),
        (_link, "'cells/0123456789abcdef/log.txt', which is no file"),
        (lambda z: z.writestr("ablation.csv", "x"), "ablation.csv stands only in the manifest, or is only in"),
    ],
)
def test_hostile_archives_are_refused(tmp_path: Path, add: Callable[[zipfile.ZipFile], None], said: str) -> None:
    path = tmp_path / "in" / "hostile.zip"
    path.parent.mkdir()
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("manifest.json", json.dumps({"files": {"plan.json": {"sha256": sha256(b"{}").hexdigest()}}}))
        archive.writestr("plan.json", "{}")
        add(archive)
    with pytest.raises(UserError) as error:
        unpack(path, tmp_path / "in" / "out")
    assert said in str(error.value)
    assert {p.name for p in tmp_path.rglob("*")} <= {"in", "hostile.zip", "out", "cells"}


def test_links_are_not_exported_and_stale_runs_are_refused(tmp_path: Path) -> None:
    folder = done(tmp_path / "run", "flat")
    secret = tmp_path / "secret"
    secret.write_text("the key")
    (log,) = folder.glob("cells/*/log.txt")
    log.unlink()
    log.symlink_to(secret)
    (folder / "sweeps.csv").symlink_to(secret)
    archive, _ = export(folder)
    with zipfile.ZipFile(archive) as opened:
        assert not {"sweeps.csv", log.relative_to(folder).as_posix()} & set(opened.namelist())
    (tmp_path / "thesis.zip").write_bytes(b"mine")
    with pytest.raises(UserError, match="is no exported run"):
        export(folder, tmp_path / "thesis.zip")
    (folder / "results.csv").write_text("by hand")
    with pytest.raises(UserError, match="not as they were written: type matbench score"):
        export(folder)
    assert (tmp_path / "thesis.zip").read_bytes() == b"mine"


def test_scoring_runs_no_code_that_a_run_folder_names(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = done(tmp_path / "run", "flat")
    plan = json.loads((folder / "plan.json").read_text())
    evil = tmp_path / "evil.py"
    evil.write_text(f"open({str(tmp_path / 'executed')!r}, 'w')\n")
    plan["plugin_files"] = [str(evil)]
    plan["cells"][0]["method"]["algorithm"] = str(evil)
    (folder / "plan.json").write_text(json.dumps(plan))
    status, out, err = run(capsys, "score", folder)
    assert status == 0, err
    assert "byte for byte" not in out, "the method is called otherwise now"
    assert not (tmp_path / "executed").exists()


def test_missing_and_changed_scenes_are_said_and_nothing_is_lost(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = done(tmp_path / "run", "flat", scene=f"{SMALL},synthetic/weak[size=48x36]")
    before = (folder / "results.csv").read_bytes()
    plan = (folder / "plan.json").read_text()
    (folder / "plan.json").write_text(plan.replace("synthetic/weak", "middlebury2006/Rocks1"))
    status, _, err = run(capsys, "score", folder)
    assert status == 2
    assert err.count("\n") == 1
    assert "1 of 2 scenes: middlebury2006/Rocks1" in err
    assert "it is not here" in err
    assert (folder / "results.csv").read_bytes() == before
    status, out, err = run(capsys, "score", folder, "--partial")
    assert status == 0, err
    assert "without middlebury2006/Rocks1" in out
    assert set(pd.read_csv(folder / "results.csv").scene) == {SMALL}


def test_runs_are_joined_where_they_are_alike_and_refused_where_not(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    one, two = done(tmp_path / "one", "flat", "noise"), done(tmp_path / "two", "noise", "empty")
    status, _, err = run(capsys, "score", one, two, "--out", tmp_path / "both")
    assert status == 0, err
    both = pd.read_csv(tmp_path / "both" / "results.csv", keep_default_na=False)
    assert list(both.algorithm.unique()) == ["flat", "noise", "empty"]
    assert not both.duplicated(["algorithm", "scene", "seed", "region", "metric"]).any()
    assert export(tmp_path / "both")[1] == 0
    assert run(capsys, "score", one, two)[0] == 2

    mine = tmp_path / "mine.py"
    mine.write_text(METHODS.read_text() + "\nOTHER = 1\n")
    other = done(tmp_path / "other", "flat", plugin=mine)
    with pytest.raises(UserError, match=r"flat has other code or parameters in .*other.* than in .*one"):
        join([one, other], tmp_path / "joint")
    assert not (tmp_path / "joint").exists()
    plan = json.loads((two / "plan.json").read_text())
    for cell in plan["cells"]:
        cell["scene_digest"] = "0" * 64
    (two / "plan.json").write_text(json.dumps(plan))
    with pytest.raises(UserError, match="is another scene"):
        join([one, two], tmp_path / "joint")
    with pytest.raises(UserError, match="its pixels, views or range have changed"):
        open_run(two)
    ready, _ = open_run(one)
    place = ready.store.cell(ready.plan.cells[1])
    twin = done(tmp_path / "twin", "noise")
    (there,) = (twin / "cells").iterdir()
    facts = json.loads((there / "cell.json").read_text())
    facts["outcome"] |= {"status": "failed", "maps": ""}
    (there / "cell.json").write_text(json.dumps(facts))
    assert there.name == place.name
    joined = join([twin, one], tmp_path / "joint")
    outcome = joined.outcome(ready.plan.cells[1])
    assert outcome is not None
    assert outcome.status == "ok", "of two, that which ended well"


def test_the_archive_is_checked_in_another_process_without_the_run(tmp_path: Path) -> None:
    folder = done(tmp_path / "run", "flat")
    archive, _ = export(folder)
    folder.rename(tmp_path / "gone")
    line = [sys.executable, "-m", "matbench", "score", str(archive)]
    told = subprocess.run(line, capture_output=True, text=True, timeout=120, cwd=tmp_path)
    assert told.returncode == 0, told.stderr
    assert Store(tmp_path / "gone").command() == "typed"
