"""Files from elsewhere: runs with links, pipes and numbers in them, archives that claim too much, and any damage.

The last is a small run of ``tests/proofs/fuzz.py``.
"""

import io
import json
import os
import resource
import shutil
import subprocess
import sys
import time
import zipfile
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest
from finished_runs import done
from places import TESTS

from matbench.errors import UserError
from matbench.results import archive
from matbench.results.status import standing

MUTANTS, SEED = 300, 7
ROOM = 3 << 30
"""Bytes of address space of a command, libraries included."""


@pytest.fixture(scope="module")
def clean(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return done(tmp_path_factory.mktemp("clean") / "run", "flat")


@pytest.fixture
def run(clean: Path, tmp_path: Path) -> Path:
    return shutil.copytree(clean, tmp_path / "run")


def typed(*words: object) -> subprocess.CompletedProcess[str]:
    """A command in a process that may not use much memory, and not for ever."""
    return subprocess.run(
        [sys.executable, "-m", "matbench", *map(str, words)],
        capture_output=True,
        text=True,
        timeout=300,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (ROOM, ROOM)),
    )


def in_words(made: subprocess.CompletedProcess[str]) -> str:
    """What a command said that was refused: a line, and status 2."""
    assert "Traceback" not in made.stderr, made.stderr
    assert made.returncode == 2, made.stderr
    (line,) = made.stderr.strip().splitlines()
    return line


def to_zeros(path: Path) -> None:
    path.symlink_to("/dev/zero")


@pytest.mark.parametrize("lie", [to_zeros, os.mkfifo])
def test_a_run_folder_with_what_never_ends_is_read_at_once(run: Path, lie: Callable[[Path], None]) -> None:
    (cell,) = run.glob("cells/*/cell.json")
    for file in (run / "results.csv", run / "cells.csv", run / "scores.json", run / ".work.json", cell):
        content = file.read_bytes() if file.exists() else None
        file.unlink(missing_ok=True)
        lie(file)
        begin = time.monotonic()
        found = standing(run)
        assert time.monotonic() - begin < 10
        assert found.cells == 1
        assert found.left == (1 if file == cell else 0)
        file.unlink()
        if content is not None:
            file.write_bytes(content)
    (run / "plan.json").unlink()
    lie(run / "plan.json")
    assert "plan.json is a " in in_words(typed("status", run))


@pytest.mark.parametrize("number", ["1.7e308", "1e999", "NaN", "-1", "1" + "0" * 400])
def test_a_number_that_cannot_be_is_no_number(run: Path, number: str) -> None:
    (cell,) = run.glob("cells/*/cell.json")
    facts = json.loads(cell.read_text())
    for name in ("seconds", "warmup_seconds"):
        text = json.dumps(facts).replace(json.dumps({name: facts["outcome"][name]})[1:-1], f'"{name}": {number}')
        cell.write_text(text)
        assert standing(run).left == 1, "half a cell is no cell"


def test_a_plan_of_a_kilobyte_means_no_gigabytes(run: Path) -> None:
    plan = json.loads((run / "plan.json").read_text())
    plan["cells"][0]["scene"] = "synthetic/box[" + " ".join(f"o{k}=1,2" for k in range(40)) + "]"
    (run / "plan.json").write_text(json.dumps(plan))
    assert "names 1099511627776 scenes: give one value for each option" in in_words(typed("score", run))


def bomb(folder: Path, clean: Path) -> Path:
    """An exported run whose maps claim half a gigabyte, in half a megabyte, with right digests."""
    (cell,) = clean.glob("cells/*/cell.json")
    maps = f"{cell.parent.relative_to(clean)}/disparity.npz"
    held = io.BytesIO()
    np.savez_compressed(held, **{f"view_{k}": np.zeros((8000, 8000), np.float32) for k in range(2)})
    exported, _ = archive.export(clean, folder / "honest.zip")
    with zipfile.ZipFile(exported) as old, zipfile.ZipFile(folder / "bomb.zip", "w", zipfile.ZIP_DEFLATED) as new:
        files = {name: old.read(name) for name in old.namelist()}
        files[maps] = held.getvalue()
        manifest = json.loads(files["manifest.json"])
        manifest["files"][maps]["sha256"] = sha256(files[maps]).hexdigest()
        files["manifest.json"] = json.dumps(manifest).encode()
        for name, content in files.items():
            new.writestr(name, content)
    return folder / "bomb.zip"


def test_maps_that_are_none_of_their_scene_are_not_unpacked(clean: Path, tmp_path: Path) -> None:
    path = bomb(tmp_path, clean)
    assert path.stat().st_size < 1 << 20
    code = (
        "import resource, sys; from pathlib import Path; from matbench.results import archive, status;"
        "from matbench.runs.store import Store; archive.unpack(Path(sys.argv[1]), Path(sys.argv[2]));"
        "store = Store(Path(sys.argv[2])); (cell,) = store.plan().cells;"
        "before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss; print(store.read(cell).outcome);"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before >> 10)"
    )
    line = [sys.executable, "-c", code, str(path), str(tmp_path / "out")]
    made = subprocess.run(line, capture_output=True, text=True, timeout=300)
    outcome, grown = made.stdout.split()
    assert outcome == "None", "damaged"
    assert int(grown) < 64, "MiB"


def test_an_archive_that_unpacks_to_hundreds_of_times_its_size_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(archive, "_FREE", 1 << 24)
    path = tmp_path / "a.zip"
    names = [f"cells/{k:016x}/log.txt" for k in range(30)]
    manifest = {"files": {name: {"sha256": sha256(bytes(1 << 20)).hexdigest()} for name in names}}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as made:
        made.writestr("manifest.json", json.dumps(manifest))
        for name in names:
            made.writestr(name, bytes(1 << 20))
    with pytest.raises(UserError, match=r"unpacks to more than .* bytes: that cannot be right"):
        archive.unpack(path, tmp_path / "out")


def test_spoilt_files_are_read_or_refused() -> None:
    line = [sys.executable, str(TESTS / "proofs" / "fuzz.py"), "--mutants", str(MUTANTS), "--seed", str(SEED)]
    done = subprocess.run(line, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    *faults, last = done.stdout.splitlines()
    assert not faults, done.stdout
    found = json.loads(last)
    assert found["mutants"] == MUTANTS
    assert found["came"]["read"] + found["came"]["refused"] == MUTANTS
    assert found["came"]["refused"] > MUTANTS / 3, "spoilt they are"


CONTROL = """
import sys, time
sys.path[:0] = sys.argv[1:3]
from pathlib import Path
import fuzz
from corpus import Target
from matbench.errors import UserError
def leaks(place): bytearray(500 << 20)
def hangs(place): time.sleep(60)
def raises(place): {}["key"]
def talks(place): raise UserError("one\\ntwo")
place = Path(sys.argv[3])
(place / "corpus").mkdir()
(place / "corpus" / "a").write_text("1")
import signal
signal.signal(signal.SIGALRM, fuzz._alarm)
signal.signal(signal.SIGPROF, fuzz._alarm)
enough = fuzz.SECONDS
for read in (leaks, hangs, raises, talks):
    fuzz.SECONDS = 0.5 if read is hangs else enough
    target = Target("control", place / "corpus", ("a",), read, sent=True)
    print(read.__name__, fuzz.one(0, 0, [target], place)["fault"].split()[0])
"""


def test_the_fuzzer_finds_what_it_looks_for(tmp_path: Path) -> None:
    line = [sys.executable, "-c", CONTROL, str(TESTS), str(TESTS / "proofs"), str(tmp_path)]
    done = subprocess.run(line, capture_output=True, text=True, timeout=120)
    found = dict(line.split() for line in done.stdout.splitlines())
    assert found == {"leaks": found.get("leaks"), "hangs": "too", "raises": "KeyError:", "talks": "more"}, done.stderr
    assert int(found["leaks"] or 0) >= 499
