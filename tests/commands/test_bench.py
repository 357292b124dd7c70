"""Speed that is judged from the command line, and a slow-down that is planted."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import prove
import pytest
from reference import digest
from subjects import KERNELS

from matbench.bench import base, baselines, machine
from matbench.bench.baselines import Baseline
from matbench.bench.measuring import Tree
from matbench.cli import main
from matbench.plans import kernels


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--only", "winer"], "unknown subject 'winer': did you mean 'winner'?"),
        (["--rounds", "2"], "rounds 2 is not"),
        (["--margin", "0"], "margin 0 is not"),
        (["--base", "no-such-commit"], "base 'no-such-commit' is no commit"),
        (["--base=--help-me"], "base '--help-me' is no commit"),
        (["--update", "--base", "HEAD"], "three different things"),
        (["--update", "--only", "sgbm"], "leave out --only sgbm"),
        (["--out", "x"], "add --scaling"),
        (["--scaling", "--only", "nobody"], "unknown method 'nobody'"),
        (["--pairs", "1", "--base", "HEAD"], "one pair has no interval"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(
    arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as stopped:
        main(["bench", *arguments])
    assert stopped.value.code == 2
    complaint = capsys.readouterr().err.strip().splitlines()[-1]
    assert said in complaint


def _run(code: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """`matbench bench` of a copy of the checkout."""
    # a folder of kernels that was handed on to this process would be used where the code is the same
    inherited = {name: value for name, value in os.environ.items() if name != kernels.VARIABLE}
    cache = {"XDG_CACHE_HOME": str(code.parent / "cache")}
    command = [sys.executable, "-m", "matbench", "bench", *arguments]
    return subprocess.run(command, cwd=code, env={**inherited, **cache}, capture_output=True, text=True, check=False)


def test_slow_downs_can_still_be_planted() -> None:
    for plant in prove.PLANTS:
        compile(prove.planted(plant), plant.file, "exec")
        assert plant.subject in KERNELS


def test_a_planted_slow_down_is_caught_and_unchanged_code_is_not(tmp_path: Path) -> None:
    """The short version of tests/benchmarks/prove.py, with a slow-down that no noise comes near."""
    code = prove.copy_checkout(tmp_path / "code")
    in_turns = code / "matbench" / "bench" / "base.py"
    text = in_turns.read_text(encoding="utf-8")
    assert text.count("PAIRS = 4\n") == 1
    in_turns.write_text(text.replace("PAIRS = 4\n", "PAIRS = 2\n"), encoding="utf-8")
    chosen = ("--only", "voxel pooling", "--rounds", "9", "--margin", "0.4")
    judged = ("--no-work", "--json")

    new = _run(code, *chosen, *judged)
    assert new.returncode == 0, new.stderr
    assert "not judged: no baseline is stored" in new.stdout
    (first,) = json.loads(new.stdout)["times"]
    # as if it had been stored on a calmer machine: what seems slower is decided in turns
    stored = Baseline(machine.kind(), digest(), baselines.code_digest(code), {"voxel pooling": first["ratio"] / 3})
    path = baselines.store_baseline(baselines.folder(Tree(code, Path(sys.executable), tmp_path)), stored)
    assert base.last_change(code, path) is None, "no repository"
    prove.repository(code)
    unchanged = _run(code, *chosen, *judged)
    assert unchanged.returncode == 0, unchanged.stdout
    (same,) = json.loads(unchanged.stdout)["times"]
    assert 0.8 < same["against"]["ratio"] < 1.25

    def compiled() -> dict[Path, int]:
        kept = tmp_path / "cache" / "matbench" / "kernels" / str(base.last_change(code, path)) / "kernels"
        return {file: file.stat().st_mtime_ns for file in kept.rglob("*.nbc")}

    before = compiled()
    # what a process that was killed leaves behind is in nobody's way
    commit = str(base.last_change(code, path))
    killed = tmp_path / "cache" / "matbench" / "kernels" / commit / "code"
    subprocess.run(["git", "-C", code, "worktree", "add", "-q", "--detach", killed, commit], check=True)
    source = code / "algorithms" / "voxel_coloring.py"
    text = source.read_text(encoding="utf-8")
    loop = "    for y in range(first, end):\n        number = sums[0, y]\n"
    assert text.count(loop) == 1
    twice = loop.replace(
        "y in range(first, end):\n", "turn in range(2 * (end - first)):\n        y = first + turn // 2\n"
    )
    source.write_text(text.replace(loop, twice), encoding="utf-8")
    slower = _run(code, *chosen, *judged)
    assert slower.returncode == 3, slower.stdout
    found = json.loads(slower.stdout)
    assert found["times"][0]["verdict"] == "slower"
    assert found["accepted"] == base.last_change(code, path)
    assert f"in turns with {found['accepted'][:8]}" in found["said"][-1]
    assert compiled() == before, "what was compiled of the stored code is used again"
    assert before

    against = _run(code, *chosen, "--base", "HEAD", "--pairs", "2", "--markdown")
    (row,) = [line for line in against.stdout.splitlines() if line.startswith("| voxel pooling |")]
    assert 1.6 < float(row.split("|")[3]) < 2.4
    left = subprocess.run(["git", "-C", code, "worktree", "list"], check=True, capture_output=True, text=True)
    assert len(left.stdout.splitlines()) == 1

    shallow = tmp_path / "shallow"
    subprocess.run(["git", "clone", "-q", "--depth", "1", f"file://{code}", shallow], check=True)
    assert base.last_change(shallow, shallow / path.relative_to(code)) is None
    path.write_text(path.read_text(encoding="utf-8") + " ", encoding="utf-8")
    assert base.last_change(code, path) is None, "not committed as it is"


def test_without_a_checkout_it_says_so(tmp_path: Path) -> None:
    code = prove.copy_checkout(tmp_path / "installed")
    shutil.rmtree(code / "tests")
    done = _run(code)
    assert done.returncode == 2
    assert "timings are judged in a checkout" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
