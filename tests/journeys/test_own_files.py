"""`--plugin` wherever it exists: scenes and metrics of one's own, run, scored again, shown, and missed in one line."""

import json
from pathlib import Path

import pandas as pd
import pytest
from shown import OWN_FILES
from tools import need

from matbench.cli import main
from matbench.plans import plugins
from matbench.plans.settings import Settings
from matbench.runs.store import Store


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the files that the documentation shows; it is the current one."""
    for name, text in OWN_FILES.items():
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]):
    """Exit status, output and errors of a command line."""

    def typed(*words: str) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as ended:
            main(words)
        told = capsys.readouterr()
        return int(ended.value.code or 0), told.out, told.err

    return typed


COMPARE = ("compare", "-a", "mine", "-s", "walls/*", "-m", "too_near", "--out", "run")
FILES = ("--plugin", "mine.py", "--plugin", "walls.py", "--plugin", "judge.py")


def missed(run, said: str, *words: str) -> None:
    """A command fails with exactly one line that says so."""
    status, out, err = run(*words)
    assert status == 2, out + err
    assert said in err
    assert err.count("\n") == 1


def test_a_run_of_scenes_and_metrics_of_ones_own_from_plan_to_table(place: Path, run) -> None:
    status, out, _ = run(*COMPARE, *FILES, "--dry-run")
    assert status == 0
    assert "2 would run" in out
    assert not (place / "run").exists()

    status, out, err = run(*COMPARE, *FILES, "--jobs", "2", "--json")
    assert status == 0, err
    told = json.loads(out)
    assert told["metric"] == {"name": "too_near", "unit": "%", "better": "lower"}
    assert told["cells"] == {"ok": 2}
    assert told["table"][0]["regions"]["all"] == 50, "4 px per view step: too near for the wall at 2, not for that at 6"
    before = (place / "run/results.csv").read_bytes()

    missed(run, "unknown metric 'too_near'", "score", "run", "-m", "too_near")
    missed(run, "walls/near: it is not here: unknown dataset 'walls'", "score", "run")
    missed(run, f"--plugin reads {place / 'mine.py'} {place / 'walls.py'}", "score", "run")
    missed(run, "nothing offers fine, too_near, roughness of run/results.csv", "score", "run", "--plugin", "walls.py")
    assert (place / "run/results.csv").read_bytes() == before

    status, out, _ = run("status", "run")
    assert "stale" not in out

    status, out, err = run("score", "run", *FILES)
    assert status == 0, err
    assert "the scores are what they were, byte for byte" in out
    status, out, _ = run("score", "run", "--partial", "--plugin", "walls.py")
    assert status == 0
    assert not set(pd.read_csv("run/results.csv")["metric"]) & {"fine", "too_near", "roughness"}


def test_a_table_for_a_paper_needs_to_know_what_is_better(place: Path, run) -> None:
    run(*COMPARE, *FILES)
    missed(run, "nothing offers fine, so nobody knows what is better: add --plugin", "report", "run", "-m", "fine")
    for metric, word in (("fine", "higher"), ("too_near", "lower")):
        status, out, err = run("report", "run", "-m", metric, "--format", "tex", "--plugin", "judge.py")
        assert status == 0, err
        assert f"{word} is better" in out


def test_an_archive_s_own_metrics_are_checked_with_the_file_that_is_given(place: Path, run) -> None:
    run(*COMPARE, *FILES)
    assert run("export", "run", "--out", "run.zip")[0] == 0
    missed(run, "walls/near: it is not here", "score", "run.zip")
    status, out, err = run("score", "run.zip", *FILES)
    assert status == 0, err
    assert "the scores are what they were, byte for byte" in out
    text = (place / "judge.py").read_text()
    assert text.count("errors > 1") == 1
    (place / "judge.py").write_text(text.replace("errors > 1", "errors > 3"))
    plugins.code_digest.cache_clear()  # another process would read it anew
    status, out, _ = run("score", "run.zip", *FILES)
    assert status == 1
    assert "too_near: 100.0 then, 0.0 now" in out
    assert "by another scorer" in out
    assert out.count("+") >= 2, "the scorer and the file, then and now"


def test_a_metric_that_came_later_is_scored_from_the_stored_maps(place: Path, run) -> None:
    run("compare", "-a", "mine", "-s", "walls/near", "--plugin", "mine.py", "--plugin", "walls.py", "--out", "run")
    keys = sorted(path.name for path in (place / "run/cells").iterdir())
    status, _, err = run("score", "run", "--plugin", "walls.py", "--plugin", "judge.py", "-m", "fine")
    assert status == 0, err
    assert "fine" in set(pd.read_csv("run/results.csv")["metric"])
    assert sorted(path.name for path in (place / "run/cells").iterdir()) == keys


def test_what_is_offered_is_listed(place: Path, run) -> None:
    status, out, _ = run("list", "--json", *FILES)
    assert status == 0
    told = json.loads(out)
    known = {"views": 3, "sizes": {"96x72": [96, 72]}, "truth": True, "present": True, "endless": False}
    assert told["scenes"]["walls/near"] == known
    assert told["metrics"]["roughness"] == {
        "unit": "px",
        "better": "lower",
        "about": "mean change of the error along rows",
    }
    assert "mine" in told["algorithms"]
    missed(run, "does not exist", "list", "--plugin", "none.py")
    missed(run, "walls.py holds no method", "check", "walls.py")
    assert run("list", *FILES)[1].count("96x72") == 2, "of two walls; a size that is its own name is told once"


def test_pictures_of_metrics_are_drawn(place: Path, run) -> None:
    run(*COMPARE, *FILES)
    missed(run, "unknown dataset 'walls'", "figure", "maps", "run")
    missed(run, "metric roughness has no picture", "figure", "maps", "run", "-m", "roughness", *FILES)
    status, _, err = run("figure", "maps", "run", "-m", "too_near", *FILES)
    assert status == 0, err
    assert "too_near, 0 (black) to 100 % and more (pale)" in (place / "run/maps.txt").read_text()


def test_a_picture_that_fails_is_said_in_one_line(place: Path, run) -> None:
    run(*COMPARE, *FILES)
    for picture, said in (("lambda found: found.error[0]", "(96,), not (72, 96) numbers"), ("max", "TypeError")):
        (place / "bad.py").write_text(
            "from matbench import Metric\n"
            f"M = Metric('bad', 'px', 'lower', '', max, takes='signed', picture={picture})\n"
        )
        missed(run, said, "figure", "maps", "run", "-m", "bad", "--plugin", "walls.py", "--plugin", "bad.py")


def test_scenes_of_ones_own_are_shown_and_checked(place: Path, run) -> None:
    assert run("scene", "show", "walls/far", "--plugin", "walls.py")[0] == 0
    assert (place / "scene-walls-far.png").stat().st_size > 1000
    _, out, err = run("scene", "check", "walls/far", "--plugin", "walls.py")
    assert "3 views of 96x72 px, reference view 1" in out, err


def test_a_cluster_is_sent_the_scenes(place: Path) -> None:
    need("dask")
    import matbench

    table = matbench.compare(
        "mine", "walls/near", plugin=["mine.py", "walls.py", "judge.py"], settings=Settings(dask="local"), out="run"
    )
    assert (table["metric"] == "roughness").any()
    (cell,) = Store(Path("run")).plan().cells
    outcome = Store(Path("run")).outcome(cell)
    assert outcome is not None
    assert (outcome.status, outcome.alone) == ("ok", False)
