"""Speed is measured by the commands that the documentation shows, in a small copy of the checkout.

The copy has one method and one kernel, which is fed with noise. It is a repository, with a commit that is
`origin/main`. `bench` is told to take the fewest rounds and pairs and to be content with a wide margin, and of what
grows one method for some seconds. `prove.py` has one slow-down to plant, tries once, warms nothing up, takes each pair
of processes once and loads one core; with load it measures the planted one alone.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import prove
import pytest
from following import PROVE, lines, words

FEWER = ("--rounds", "5", "--pairs", "2", "--margin", "0.5")
SUBJECTS = """

def _cost() -> NDArray[np.float32]:
    return np.random.default_rng(0).random((72, 96, 24), np.float32)


METHODS = {"sgbm": METHODS["sgbm"]}
KERNELS = {"winner": winner}
"""
PLANTS = 'PLANTS = tuple(plant for plant in PLANTS if plant.subject == "winner")\n'
PROGRAM = 'if __name__ == "__main__":\n'
CHANGES = (
    (PROVE, PROGRAM, PLANTS + PROGRAM),
    (PROVE, "            proof.compile()\n", "            pass\n"),
    ("tests/benchmarks/load.py", "range((os.cpu_count() or 1) * wanted)", "range(wanted)"),
    ("matbench/bench/base.py", "PAIRS = 4\n", "PAIRS = 1\n"),
    ("matbench/bench/baselines.py", "UPDATES = 5\n", "UPDATES = 1\n"),
)


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Path:
    code: Path = prove.copy_checkout(tmp_path_factory.mktemp("bench") / "code")
    for name, before, after in CHANGES:
        text = (code / name).read_text()
        assert text.count(before) == 1, f"{name} has changed: mend what CHANGES says of it"
        (code / name).write_text(text.replace(before, after))
    benchmarks = code / "tests" / "benchmarks"
    with (benchmarks / "subjects.py").open("a") as subjects:
        subjects.write(SUBJECTS)
    counters = json.loads((benchmarks / "counters.json").read_text())
    (benchmarks / "counters.json").write_text(json.dumps({"sgbm": counters["sgbm"]}))
    prove.repository(code)
    subprocess.run(["git", "-C", code, "update-ref", "refs/remotes/origin/main", "HEAD"], check=True)
    return code


def run(code: Path, *tokens: str) -> str:
    """What a program says that is run in the copy, and must end well."""
    environment = {**os.environ, "XDG_CACHE_HOME": str(code.parent / "cache")}
    done = subprocess.run(
        [sys.executable, *tokens], cwd=code, env=environment, capture_output=True, text=True, check=False, timeout=600
    )
    assert done.returncode == 0, f"{tokens}\n{done.stdout[-2000:]}{done.stderr}"
    return done.stdout


def stores(line: object) -> bool:
    """What is stored is judged from then on, and this machine may be busy: such a line comes last."""
    return "--update" in str(line)


@pytest.mark.parametrize("line", sorted(lines("bench"), key=stores), ids=str)
def test_speed_is_measured(line: str, checkout: Path) -> None:
    growth = ("--only", "sgbm", "--seconds", "2") if "--scaling" in line else ()
    said = run(checkout, "-m", "matbench", *words(line), *FEWER, *growth)
    if stores(line):
        (stored,) = (checkout / "tests" / "benchmarks" / "baselines").iterdir()
        assert json.loads(stored.read_text())["ratios"].keys() == {"sgbm", "winner"}
    elif "--scaling" in line:
        assert (checkout / "growth" / "growth.png").is_file()
    else:
        assert {"sgbm", "winner"} <= set(said.split())


@pytest.mark.parametrize("line", lines("prove"), ids=str)
def test_slow_downs_are_planted_and_looked_for(line: str, checkout: Path) -> None:
    loaded = "--load" in line
    said = run(checkout, PROVE, *words(line), "--tries", "1", *(("--only", "caught") if loaded else ()))
    found = json.loads(said.splitlines()[-1])
    assert (found["planted"], found["unchanged"], found["load"]) == (1, not loaded, loaded)
    assert found["measured"].keys() == {"winner"}
