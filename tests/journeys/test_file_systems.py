"""Runs on file systems that offer less than usual, that several users share, or that may only be read."""

import errno
import json
import os
import re
import shutil
import stat
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from finished_runs import SMALL, done
from places import METHODS
from refusing import as_user, refusing

from matbench.runs.store import Store

LESS = {
    "chmod": errno.EPERM,
    "flock": errno.ENOLCK,
    "fsync": errno.EINVAL,
    "fsync_folder": errno.EINVAL,
    "link": errno.EPERM,
    "rename_over": errno.EPERM,
}
"""What may be missing on SMB, FAT and S3 mounts."""


SEVERAL = """
import json, sys
from matbench.cli import main
for line in json.loads(sys.argv[1]):
    try:
        main(line)
    except SystemExit as end:
        print(f"status {end.code or 0}", flush=True)
"""


def matbench(*lines: Sequence[str | Path], before: Sequence[str] = (), **more: Any) -> tuple[list[str], str]:
    """What each line prints and ends with, and all errors; they are run by one process, as starting takes long."""
    words = json.dumps([list(map(str, line)) for line in lines])
    done = subprocess.run(
        [*before, sys.executable, "-c", SEVERAL, words], capture_output=True, text=True, timeout=300, **more
    )
    assert "Traceback" not in done.stderr
    told = re.split(r"(?<=status \d)\n", done.stdout)[:-1]
    assert len(told) == len(lines), done.stderr
    return told, done.stderr


def compare(run: Path, *more: str) -> list[str | Path]:
    return ["compare", "-a", "flat", "noise", "--plugin", METHODS, "-s", SMALL, "--out", run, *more]


def test_what_a_file_system_does_not_offer_is_said_once_and_the_run_is_as_any_other(tmp_path: Path) -> None:
    place = tmp_path / "share"
    place.mkdir()
    run = place / "run"
    lines = [compare(run), ["export", run], ["export", run]]  # the last one over what is there
    told, remarks = matbench(*lines, env=refusing(tmp_path, place, LESS))
    assert all(one.endswith("status 0") for one in told), remarks
    assert remarks.count("nothing can be locked in") == 1
    assert remarks.count("does not tell when files are safe on the disk") == 1
    assert remarks.count("\n") == 2, remarks
    usual = done(tmp_path / "usual", "flat", "noise")
    assert (run / "results.csv").read_bytes() == (usual / "results.csv").read_bytes()
    assert not [path for path in place.rglob(".*") if path.name != ".lock"], "no drafts"


@pytest.fixture
def open_to_all() -> Iterator[Path]:
    """A folder that other users can reach: those of pytest are for one user."""
    with TemporaryDirectory(prefix="matbench-tests-") as name:
        Path(name).chmod(0o755)
        yield Path(name)


def test_a_group_shares_a_run(open_to_all: Path) -> None:
    """Two users of this system, in a folder whose files belong to their group."""
    place, group = open_to_all / "shared", 4321
    one, two = (as_user(number, group, open_to_all / str(number), umask="002") for number in (1234, 1235))
    place.mkdir()
    os.chown(place, 0, group)
    place.chmod(0o2775)
    run = place / "run"
    began, said = matbench(compare(run, "-q"), before=one)
    assert began[0].endswith("status 0"), said
    for path in [run, *run.rglob("*")]:
        facts = path.lstat()
        assert (facts.st_uid, facts.st_gid) == (1234, group), path
        assert stat.S_IMODE(facts.st_mode) == (0o2775 if path.is_dir() else 0o664), path
    first, second = (cell.key for cell in Store(run).plan().cells)
    (run / "cells" / first / "cell.json").write_text("damaged")
    lines = [compare(run, "-q"), ["score", run], ["export", run], ["status", run]]
    told, said = matbench(*lines, before=two)
    assert all(line.endswith("status 0") for line in told), said
    owners = [(run / "cells" / key / "cell.json").stat().st_uid for key in (first, second)]
    assert owners == [1235, 1234], "what was damaged is computed again, by the other"
    told, said = matbench(["export", run], before=one)
    assert all(line.endswith("status 0") for line in told), said


def test_a_run_that_may_only_be_read_is_scored_exported_and_looked_at(open_to_all: Path) -> None:
    here = open_to_all / "visitor"
    visitor = as_user(1234, 4321, here)
    run = done(open_to_all / "run", "flat", "noise")
    before = {path: path.lstat().st_mtime_ns for path in [run, *run.rglob("*")]}
    lines = [
        ["status", run],
        ["score", run],
        ["score", run, "--out", "kept"],
        ["export", run],
        ["report", run],
        ["figure", "maps", run, "--plugin", METHODS],
        compare(run, "--only", "all"),
    ]
    told, said = matbench(*lines, before=visitor, cwd=here)
    assert [one[-1] for one in told] == list("0000022"), said
    status, scored, kept, exported, *_ = told
    assert "2 of 2 cells done" in status
    assert f"{run} is read-only: its tables are only printed" in scored
    assert "the scores are what they were, byte for byte" in scored
    assert "report:" not in scored, "nothing is kept"
    assert "report: kept/report.html" in kept
    assert (here / "kept" / "results.csv").read_bytes() == (run / "results.csv").read_bytes()
    assert "archive: run.zip" in exported
    drawn, refused = said.splitlines()
    assert "is read-only: say by --out where the figure goes" in drawn
    assert f"output folder {str(run)!r} cannot be used: Permission denied" in refused
    assert {path: path.lstat().st_mtime_ns for path in [run, *run.rglob("*")]} == before


READ_ONLY = 'mount --bind "$1" "$1" && mount -o remount,ro,bind "$1" || exit 77; shift; exec "$@"'


def test_a_run_on_a_read_only_file_system_is_scored_and_exported(tmp_path: Path) -> None:
    """A real one, in a name space of its own."""
    run = done(tmp_path / "theirs" / "run", "flat")
    mounted = ["unshare", "-rm", "sh", "-c", READ_ONLY, "sh", str(run.parent)]
    if shutil.which("unshare") is None or subprocess.run([*mounted, "true"], capture_output=True).returncode:
        pytest.skip("a read-only file system cannot be mounted here")
    here = tmp_path / "here"
    here.mkdir()
    (scored, exported, drawn), said = matbench(
        ["score", run], ["export", run], ["figure", "maps", run, "--plugin", METHODS], before=mounted, cwd=here
    )
    assert f"{run} is read-only: its tables are only printed" in scored, said
    assert scored.endswith("status 0")
    assert exported.startswith("archive: run.zip\n")
    assert (here / "run.zip").exists()
    assert drawn == "status 2"
    assert "is read-only: say by --out where the figure goes" in said
    kept = {".lock", "cells", "cells.csv", "plan.json", "results.csv", "scores.json"}
    assert {path.name for path in run.iterdir()} == kept
