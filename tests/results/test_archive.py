"""Runs as archives: whole, the same bytes every time, checked, and harmless to whoever opens them."""

import json
import os
import zipfile
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path

import pytest
from finished_runs import done
from typing_commands import run

from matbench.errors import UserError
from matbench.results import archive as archives
from matbench.results import freshness
from matbench.results.archive import export, unpack


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


def test_of_a_run_that_is_read_only_it_is_said_how_its_tables_are_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Simulated: for root everything is writable."""
    folder = done(tmp_path / "my run", "flat")
    (folder / "results.csv").write_text("by hand")
    for module in (archives, freshness):
        monkeypatch.setattr(module, "is_writable", lambda path: path != folder)
    with pytest.raises(UserError, match=r"type matbench score '.*/my run' --out NEW and export that$"):
        export(folder)
