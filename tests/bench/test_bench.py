"""Speed that is judged: the statistics, the verdicts, the command, and a slow-down that is planted."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from io import StringIO
from pathlib import Path

import numpy as np
import prove
import pytest
from attrs import evolve
from places import ROOT, TESTS
from reference import digest
from subjects import KERNELS, METHODS, instance, scene

from matbench.algorithm import Context
from matbench.bench import base, baselines, counting, growth, growth_report, machine, tables
from matbench.bench.baselines import Baseline, Judged
from matbench.bench.measuring import Sitting, Timing, Tree
from matbench.bench.roofline import Roofline
from matbench.bench.turns import Turns, in_turns
from matbench.cli import main
from matbench.commands.console import Console
from matbench.errors import UserError
from matbench.measures import statistics

KIND = {"processor": "Some(R) Processor 6/1/2", "cores": "2", "numba": "0.68"}
STORED = Baseline(KIND, "digest", "code", {"one": 10, "two": 20})


def sitting(**ratios: float) -> Sitting:
    return Sitting({name: Timing(r, r, r, 1.0, 1 / r, "kernel", 9) for name, r in ratios.items()}, {}, "digest")


def verdicts(
    first: Sitting, *later: float, decide: baselines.Decide = lambda _: ()
) -> tuple[list[Judged], list[Sequence[str]]]:
    """What is judged of two subjects, and who was asked to sit again; the first then measures `later`."""
    asked: list[Sequence[str]] = []
    waiting = list(later)

    def again(names: Sequence[str]) -> Sitting:
        asked.append(names)
        return sitting(one=waiting.pop(0)) if waiting else Sitting({}, {"one": "it went away"}, "digest")

    return baselines.judge(["one", "two"], STORED, first, again, decide, margin=0.15), asked


def test_what_most_processes_find_slow_is_slower() -> None:
    (one, two), asked = verdicts(sitting(one=13.0, two=20.5), 11.2, 12.9)
    assert (one.verdict, two.verdict) == ("slower", "ok")
    assert one.change == pytest.approx(0.29)
    assert asked == [["one"], ["one"]]  # nobody else is measured again


def test_one_unlucky_process_is_no_regression() -> None:
    (one, _), asked = verdicts(sitting(one=16.0, two=20.0), 10.1, 9.9)
    assert one.verdict == "ok"
    assert len(asked) == 2


def test_a_lucky_first_process_hides_nothing() -> None:
    """What is beyond ten per cent is looked at again."""
    (one, _), _ = verdicts(sitting(one=11.1, two=20.0), 12.8, 13.1)
    assert one.verdict == "slower"


def test_what_cannot_be_measured_again_has_failed() -> None:
    (one, _), _ = verdicts(sitting(one=13.0, two=20.0), 13.0)
    assert (one.verdict, one.reason) == ("failed", "it went away")


@pytest.mark.parametrize(
    ("in_turns", "verdict"),
    [((1.29, 1.31, 1.3, 1.28), "slower"), ((1.01, 0.99, 1.0, 1.02), "ok"), ((1.1, 1.11, 1.1, 1.12), "ok")],
)
def test_a_suspicion_is_decided_in_turns_with_the_code_that_was_stored(in_turns: Sequence[float], verdict: str) -> None:
    """Whatever the ratios say, as other machines' work moves them for minutes."""
    asked: list[Sequence[str]] = []

    def decide(names: Sequence[str]) -> list[base.Versus]:
        asked.append(names)
        return [base.versus(name, [Turns(ratio) for ratio in in_turns]) for name in names]

    (one, two), again = verdicts(sitting(one=13.9, two=20.5), decide=decide)
    assert (one.verdict, two.verdict) == (verdict, "ok")
    assert one.change == pytest.approx(np.exp(np.log(in_turns).mean()) - 1)
    assert (asked, again) == ([["one"]], [])
    assert f"{one.change:+.1%}" in tables.judged([one]).markdown()


def test_what_the_stored_code_lacks_is_decided_by_ratios() -> None:
    def lacks(names: Sequence[str]) -> list[base.Versus]:
        return [base.Versus(name, reason="not in the base: ImportError: no") for name in names]

    (one, _), asked = verdicts(sitting(one=13.0, two=20.5), 12.9, 13.1, decide=lacks)
    assert (one.verdict, one.against, asked) == ("slower", None, [["one"], ["one"]])


def test_the_calmest_of_several_processes_is_stored(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Others' work slows the reference, too: where it was quickest there was least of it."""
    waiting = [(14.0, 1.3), (10.0, 1.0), (13.0, 1.2), (9.0, 1.1), (12.0, 1.4)]

    def sit(*_: object) -> Sitting:
        ratio, reference = waiting.pop(0)
        return Sitting({"one": Timing(ratio, ratio, ratio, 1.0, reference, "kernel", 9)}, {}, "digest")

    monkeypatch.setattr(baselines, "sit", sit)
    stored = baselines.establish(Tree(tmp_path, tmp_path, tmp_path), ["one"])
    assert (stored.ratios, waiting) == ({"one": 10.0}, [])


def test_what_is_as_fast_as_before_is_measured_once() -> None:
    (one, two), asked = verdicts(sitting(one=10.7, two=15.0))
    assert (one.verdict, two.verdict, asked) == ("ok", "faster", [])


def test_what_could_not_be_measured_failed_and_what_is_not_stored_is_new() -> None:
    first = evolve(sitting(three=3.0), failed={"one": "ValueError: no"})
    one, three = baselines.judge(["one", "three"], STORED, first, *[lambda _: pytest.fail("nobody is suspect")] * 2)
    assert (one.verdict, one.reason, three.verdict) == ("failed", "ValueError: no", "new")
    assert "one failed: ValueError: no" in tables.judged([one, three]).markdown()


def test_tables_fit_eighty_columns() -> None:
    against = base.versus("long", [Turns(1.285), Turns(1.3)])
    longest = "materiality[preset=descent]"
    timing = Timing(1215.3, 1000, 1215.3, 0.0375, 1e-4, "method", 25)
    one = Judged(longest, "slower", timing, (1215.3,), 1090.0, against)
    for table in (tables.judged([one]), tables.compared([evolve(against, name=longest)], 0.15, "origin/main")):
        out = StringIO()
        Console(file=out, width=80).print(table.rich())
        assert all(cell in out.getvalue() for row in table.rows for cell in row)


def test_ratios_are_stored_for_a_kind_of_machine(tmp_path: Path) -> None:
    path = baselines.store_baseline(tmp_path, STORED)
    assert path.name.startswith("some-processor-6-1-2-")
    assert baselines.read(tmp_path) == [STORED]
    assert baselines.matching(tmp_path, KIND, "digest") == (STORED, "")
    found, why = baselines.matching(tmp_path, {**KIND, "numba": "0.69"}, "digest")
    assert found is None
    assert "numba 0.68 -> 0.69" in why
    assert baselines.matching(tmp_path, KIND, "another")[0] is None
    assert baselines.matching(tmp_path / "empty", KIND, "digest") == (None, "no baseline is stored")
    assert baselines.replaced(tmp_path, evolve(STORED, ratios={})) == STORED
    assert baselines.replaced(tmp_path, evolve(STORED, digest="another")) is None
    path.write_text("{", encoding="utf-8")
    assert baselines.replaced(tmp_path, STORED) is None  # and --update writes it anew
    with pytest.raises(UserError, match="no stored baseline"):
        baselines.read(tmp_path)


def test_stored_files_are_of_this_reference() -> None:
    """A changed reference makes every stored ratio worthless: measure them anew, or change it back."""
    folder = TESTS / "benchmarks" / "baselines"
    assert all(one.digest == digest() for one in baselines.read(folder))
    assert all(machine.file_name(one.machine) in {p.name for p in folder.iterdir()} for one in baselines.read(folder))


def test_the_interval_of_a_median_holds_it_as_often_as_it_says() -> None:
    draw = np.random.default_rng(1)
    held = 0
    for _ in range(300):
        median, low, high = statistics.median_interval(draw.exponential(size=25))
        assert low <= median <= high
        held += low <= np.log(2) <= high
    assert held >= 282


def test_pairs_of_processes_give_a_ratio_with_an_interval() -> None:
    slower = [Turns(ratio) for ratio in (1.3, 1.27, 1.34, 1.31)]
    found = base.versus("one", slower)
    assert found.low < found.ratio < found.high
    assert found.ratio == pytest.approx(1.305, abs=0.01)
    assert found.verdict(0.15) == "slower"
    assert found.verdict(0.4) == "same"
    assert base.versus("one", [Turns(1 / one.ratio) for one in slower]).verdict(0.15) == "faster"
    assert base.versus("one", [Turns(ratio) for ratio in (0.8, 1.6, 0.9, 1.5)]).verdict(0.15) == "unsure"
    gone = base.versus("one", [*slower, Turns(reason="not in the base: AttributeError: none")])
    assert gone.verdict(0.15) == "not compared"
    assert gone.reason == "not in the base: AttributeError: none"


def test_what_is_unsure_is_measured_in_as_many_pairs_again(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    asked: list[Sequence[str]] = []

    def pair(_: Tree, __: Tree, names: Sequence[str], ___: int, number: int) -> dict[str, Turns]:
        asked.append(list(names))
        disturbed = 0.8 if number == 1 else 1.3
        return {"calm": Turns(1.0 + number / 1000), "disturbed": Turns(disturbed), "gone": Turns(reason="no")}

    monkeypatch.setattr(base, "in_turns", pair)
    tree = Tree(tmp_path, tmp_path, tmp_path)
    found = base.compare(tree, tree, ["calm", "disturbed", "gone"], 0.15, pairs=4, progress=lambda _: None)
    assert [one.verdict(0.15) for one in found] == ["same", "slower", "not compared"]
    assert asked[:4] == [["calm", "disturbed", "gone"]] * 4
    assert asked[4:] == [["disturbed"]] * 4


def test_a_side_that_fails_is_told_with_its_reason(tmp_path: Path) -> None:
    here, cache = ROOT, tmp_path / "kernels"
    whole = Tree(here, Path(sys.executable), cache)
    code = prove.copy_checkout(tmp_path / "code")
    (code / "matbench" / "algorithms" / "semiglobal.py").write_text('raise SystemExit("broken off")\n')
    (code / "matbench" / "algorithms" / "sgbm.py").write_text("SGBM = None\n")
    found = in_turns(whole, Tree(code, whole.python, tmp_path / "others"), ["sgbm", "winner", "voxel pooling"], 3)
    assert found["sgbm"].reason == "not in the base: TypeError: 'NoneType' object is not callable"
    assert found["winner"].reason == "not in the base: SystemExit: broken off"
    assert found["voxel pooling"].ratio > 0, "a subject that fails costs no other"
    assert np.isnan(found["winner"].ratio)
    with pytest.raises(UserError, match="was measured instead of"):
        in_turns(evolve(whole, code=tmp_path), whole, ["sgbm"], 3, tests=here)


def test_changed_counters_are_told_one_by_one() -> None:
    before, now = {"a": {"passes": 5, "old": 1}}, {"a": {"passes": 6000, "new": 2}}
    assert counting.changes(before, before) == []
    assert counting.changes(before, now) == ["a: new nothing -> 2", "a: old 1 -> nothing", "a: passes 5 -> 6,000"]


def test_exponents_are_those_of_powers() -> None:
    at = np.array([1.0, 2.0, 4.0, 8.0])
    assert growth.exponent(at, 3 * at**1.5) == pytest.approx((1.5, 1.5, 1.5))
    slope, low, high = growth.exponent(at, at * np.array([1.1, 0.9, 1.0, 1.05]))
    assert low < slope < high


@pytest.mark.parametrize("name", [n for n in METHODS if n not in ("okutomi_kanade", "sgbm")])
def test_counted_bytes_of_volumes_are_allocated(name: str) -> None:
    """The volumes that a method counts are most of what it holds at once."""
    import tracemalloc

    large = scene(96, 64, 3, 40)
    instance(name).solve(scene(), Context(volume=False))  # compiles
    tracemalloc.start()
    try:
        counted = instance(name).solve(large, Context(volume=False)).work["volume_bytes"]
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert counted <= peak < 2 * counted


def test_growth_is_drawn_with_the_peer_and_the_ideal(tmp_path: Path) -> None:
    settings = sorted({s for axis in growth.AXES.values() for s in axis})
    points = []
    for name, power in (("okutomi_kanade", 1.0), ("sgbm", 1.2)):
        for setting in settings:
            point = growth.Point(name, setting, {"ssd_evaluations": 10})
            point.work = {"ssd_evaluations": point.cells}
            point.seconds, point.solves = 1e-9 * point.cells**power, 1
            points.append(point)
    found = growth.Growth(tuple(points), (), Roofline(10, 50), ())
    found = evolve(found, fits=tuple(growth._fits(found, found.methods)))
    text = growth_report.exponents(found).markdown() + growth_report.costs(found).markdown()
    assert "sgbm (peer)" in text
    assert "1.20 +- 0.00 (1.00)" in text
    written = growth_report.write_growth(found, tmp_path / "new")
    assert [path.name for path in written] == ["growth.csv", "growth.png", "growth.pdf"]
    assert all(path.stat().st_size > 500 for path in written)
    assert growth.chosen(["okutomi*"]) == ["okutomi_kanade", "sgbm"]


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
    cache = {"XDG_CACHE_HOME": str(code.parent / "cache")}
    command = [sys.executable, "-m", "matbench", "bench", *arguments]
    return subprocess.run(command, cwd=code, env={**os.environ, **cache}, capture_output=True, text=True, check=False)


def test_slow_downs_can_still_be_planted() -> None:
    for plant in prove.PLANTS:
        compile(prove.planted(plant), plant.file, "exec")
        assert plant.subject in KERNELS


def test_a_planted_slow_down_is_caught_and_unchanged_code_is_not(tmp_path: Path) -> None:
    """The short version of tests/benchmarks/prove.py, with a slow-down that no noise comes near."""
    code = prove.copy_checkout(tmp_path / "code")
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
    kernels = code / "algorithms" / "voxel_coloring.py"
    text = kernels.read_text(encoding="utf-8")
    loop = "    for y in range(first, end):\n        number = sums[0, y]\n"
    assert text.count(loop) == 1
    twice = loop.replace(
        "y in range(first, end):\n", "turn in range(2 * (end - first)):\n        y = first + turn // 2\n"
    )
    kernels.write_text(text.replace(loop, twice), encoding="utf-8")
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
