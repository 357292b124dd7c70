"""What methods owe the harness: the check itself, on methods that keep to it and on methods that do not."""

import json
import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import psutil
import pytest
from places import METHODS, TESTS, UNRULY
from subjects import METHODS as BUILT_IN

from matbench.cli import main
from matbench.plans.plan import methods
from matbench.scene import Scene
from matbench.scenes.catalogue import load_scene
from matbench.solving import check_scenes, check_solve, check_verdicts, method_check
from matbench.solving.check_scenes import mirrored
from matbench.solving.check_verdicts import CheckResult


def verdicts(found: list[CheckResult]) -> dict[str, str]:
    return {finding.check: finding.verdict for finding in found}


def failed(found: list[CheckResult]) -> set[str]:
    return {finding.check for finding in found if finding.verdict == "fail"}


def run(capsys: pytest.CaptureFixture[str], *words: str | Path) -> tuple[int, str, str]:
    """Exit status, output and errors of a command line."""
    with pytest.raises(SystemExit) as ended:
        main(list(map(str, words)))
    told = capsys.readouterr()
    return int(ended.value.code or 0), told.out, told.err


def unlike(scene: Scene, sign: int = 1) -> float:
    """Median grey levels by which the outermost views differ from what the reference's exact truth says."""
    gaps = []
    for view in {0, scene.n - 1} - {scene.ref}:
        truth, seen = scene.truth[scene.ref], scene.visible[scene.ref][view]
        at = np.arange(scene.width) - sign * (view - scene.ref) * truth
        column = np.clip(np.round(at), 0, scene.width - 1).astype(int)
        there = np.take_along_axis(scene.views[view].astype(float), column[..., None], axis=1)
        near = np.abs(at - column) < 0.1  # where no sampling is needed
        gaps.append(np.abs(there - scene.views[scene.ref])[seen & near])
    return float(np.median(np.concatenate(gaps)))


@pytest.mark.parametrize("name", [check_scenes.EASY, check_scenes.EITHER_SIGN])
def test_in_a_mirror_exact_truth_still_explains_all_views(name: str) -> None:
    scene = load_scene(name)
    other = mirrored(scene)
    assert other.ref == 3
    assert scene.ref == 1
    assert unlike(other) == unlike(scene) < 3
    assert unlike(other, sign=-1) > 10
    twice = mirrored(other)
    assert np.array_equal(twice.views, scene.views)
    assert twice.labels == scene.labels
    assert np.array_equal(twice.truth[1], scene.truth[1])
    assert np.array_equal(twice.visible[0], scene.visible[0])


@pytest.mark.parametrize("selector", BUILT_IN)
def test_built_in_methods_keep_to_it(selector: str, smaller: dict[str, check_scenes.Trial], tmp_path: Path) -> None:
    (method,) = methods(selector)
    answers = {name: check_solve.solve_here(method, (), trial, tmp_path / "log") for name, trial in smaller.items()}
    found = check_verdicts.judge(answers)
    assert set(verdicts(found).values()) == {"pass"}, found


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        ("pries", {"input"}),
        ("forgetful", {"seed", "threads"}),
        ("crowded", {"threads"}),
        ("infinite", {"honest"}),
        ("leaning", {"mirror"}),
        ("of_the_pair", {"range"}),
        ("positive", {"negative", "tiny"}),
        ("roomy", {"tiny"}),
        ("solid", {"answers", "views", "negative", "tiny", "constant"}),
        ("chatty", set()),
    ],
)
def test_each_broken_promise_is_found_and_no_other(name: str, wrong: set[str]) -> None:
    (method,) = methods(name, [UNRULY])
    found = method_check.check(method, [UNRULY])
    assert failed(found) == wrong, found
    assert all(finding.reason for finding in found if finding.verdict != "pass")
    if name == "roomy":
        assert "signal 11" in next(finding.reason for finding in found if finding.check == "tiny")
    if name == "chatty":
        assert found[-1].verdict == "note"
        assert "thinking" in found[-1].reason


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("writes", "read-only"),
        ("exits", "ended its process (exit status 7)"),
        ("leaves", "SystemExit"),
        ("raises", "the third digit is missing and more (methods.py:"),
        ("misshapen", "(3, 3)"),
        ("bare", "not an Estimate"),
        ("empty", "NaN everywhere"),
    ],
)
def test_what_gives_no_answer_fails_with_its_reason(name: str, said: str) -> None:
    (method,) = methods(name, [METHODS])
    found = method_check.check(method, [METHODS])
    (answers,) = (finding for finding in found if finding.check == "answers")
    assert answers.verdict == "fail"
    assert said in answers.reason


def test_what_a_method_declines_is_skipped_with_its_reason() -> None:
    (method,) = methods("twosome", [UNRULY])
    found = method_check.check(method, [UNRULY])
    assert not failed(found)
    assert {"answers", "views", "mirror", "seed"} <= {f.check for f in found if f.verdict == "skipped"}
    assert "two views only" in found[0].reason


def test_a_method_that_hangs_is_ended_and_nothing_else_is_tried() -> None:
    (method,) = methods("slow", [METHODS])
    begin = time.monotonic()
    found = method_check.check(method, [METHODS], timeout=5)
    assert time.monotonic() - begin < 28  # it sleeps for thirty
    assert found[0].reason == "easy: no answer within 5 s"
    assert failed(found) == {"answers", "views"}
    assert "not tried" in next(f.reason for f in found if f.check == "tiny")
    (breeder,) = methods("breeder", [UNRULY])
    assert method_check.check(breeder, [UNRULY], timeout=3)[0].reason == "easy: no answer within 3 s"
    left = [p for p in psutil.process_iter(["cmdline"]) if "3598.75" in (p.info["cmdline"] or [])]
    assert not left, "what it had started"


def test_the_readme_s_example_passes_on_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    readme = (TESTS.parent / "README.md").read_text()
    (example,) = re.findall(r"```python\n(import numpy as np\n.*?class Mine:.*?)```", readme, re.DOTALL)
    (tmp_path / "mine.py").write_text(example)
    status, out, _ = run(capsys, "check", f"{tmp_path}/mine.py[share=0,1]", "--json")
    assert status == 0
    told = json.loads(out)
    assert [one["method"] for one in told] == ["mine[share=0.0]", "mine[share=1.0]"]
    assert {check["verdict"] for one in told for check in one["checks"]} == {"pass"}


def test_a_package_that_is_installed_is_found_by_its_entry_point(tmp_path: Path) -> None:
    shutil.copytree(TESTS / "package", tmp_path / "package", ignore=shutil.ignore_patterns("__pycache__"))
    offline = ["--no-deps", "--no-build-isolation", "--no-index", "--quiet", "--disable-pip-version-check"]
    pip = [
        sys.executable,
        "-m",
        "pip",
        "install",
        *offline,
        "--target",
        str(tmp_path / "there"),
        str(tmp_path / "package"),
    ]
    subprocess.run(pip, check=True, timeout=300)
    line = [sys.executable, "-m", "matbench", "check", "middle_plane[share=0.25]"]
    env = os.environ | {"PYTHONPATH": str(tmp_path / "there")}
    ended = subprocess.run(line, capture_output=True, text=True, timeout=300, env=env)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert "middle_plane[share=0.25] passes" in ended.stdout


def test_failures_and_wrong_usage_have_their_own_exit_status(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status, out, _ = run(capsys, "check", "leaning", "--plugin", UNRULY)
    assert status == 1
    assert "leaning fails: mirror" in out
    for words, said in [
        ((), "no method"),
        (("sgmb",), "did you mean 'sgbm'"),
        (("middle_plane",), "unknown algorithm"),
        (("sgbm[fil=true]",), "unknown parameter"),
        (("sgbm", "--timeout", "0"), "timeout '0' is not a positive number of seconds"),
        ((str(tmp_path / "none.py"),), "does not exist"),
        (("command",), "program must be given"),
    ]:
        status, _, err = run(capsys, "check", *words)
        assert status == 2, words
        assert said in err
        assert err.count("\n") == 1
