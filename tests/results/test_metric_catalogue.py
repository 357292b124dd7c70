"""Metrics by name: those of every run, those asked for, families, and those of users' own files."""

from pathlib import Path

import pandas as pd
import pytest
from compared import SMALL
from places import METHODS

import matbench
from matbench.errors import UserError
from matbench.measures.metrics import METRICS
from matbench.plans import plugins
from matbench.plans.settings import Settings
from matbench.results import metric_catalogue

JUDGE = """
from matbench import Family, Metric


def make(most):
    return Metric(f"fine_{most:g}", "%", "higher", "at most so many px", lambda errors: 100 * (errors <= most).mean())


FINE = Family("fine_@", "error at most @ px", make, 0.1, 10)
SELDOM = Metric("seldom", "px", "lower", "asked for only", lambda errors: 1.0, always=False)
"""


@pytest.fixture
def judge(tmp_path: Path) -> Path:
    path = tmp_path / "judge.py"
    path.write_text(JUDGE)
    return path


def names(*asked: str) -> list[str]:
    return [metric.name for metric in metric_catalogue.wanted(asked)]


def test_what_is_asked_for_follows_what_every_run_has() -> None:
    every = names()
    assert every[: len(METRICS)] == [metric.name for metric in METRICS]
    assert not {"d1", "mse_100", "bumpiness"} & set(every)
    assert names("bad_1", "avg") == every
    assert names("d1", "bad_3", "total_bad_3", "a75") == [*every, "d1", "bad_3", "total_bad_3", "a75"]
    assert names("total_bad_0.07") == [*every, "total_bad_0.07", "bad_0.07"], "three numbers, never one"


def test_a_file_of_ones_own_may_hold_a_family(judge: Path, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"unknown metric 'fine_0\.25'"):
        metric_catalogue.metric_named("fine_0.25")
    with plugins.using([judge]):
        assert [family.name for family in metric_catalogue.families()][-1] == "fine_@"
        assert {"fine_0.25", "seldom"} & set(names()) == set()
        assert names("fine_0.25", "seldom")[-2:] == ["fine_0.25", "seldom"]
        with pytest.raises(UserError, match=r"metric fine_20: 20 is not a number from 0.1 to 10"):
            metric_catalogue.metric_named("fine_20")
    table = matbench.compare(
        "flat",
        SMALL,
        out=tmp_path / "run",
        plugin=[METHODS, judge],
        settings=Settings(metrics=["fine_1", "total_bad_1.5"], isolation="shared"),
    )
    scored = table[table.region == "all"].set_index("metric").value
    assert scored["fine_1"] == pytest.approx(100 - scored["total_bad_1"], abs=0.1)
    assert scored["total_bad_1.5"] <= scored["total_bad_1"]
    assert "seldom" not in scored
    on_page = (tmp_path / "run" / "report.html").read_text()
    assert '<option value="fine_1"' in on_page
    assert '<option value="1.5"' in on_page
    assert set(pd.read_csv(tmp_path / "run" / "results.csv").metric) == set(table.metric)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('Metric("bad_7", "%", "lower", "", len)', "the name of metric 'bad_7' is taken"),
        ('Metric("d1", "%", "lower", "", len)', "the name of metric 'd1' is taken"),
        ('Family("bad_@", "", len, 1, 2)', "the name of metric 'bad_@' is taken"),
        ('Family("a\\tb_@", "", len, 1, 2)', "holds a tab"),
        ('Family("mine", "", len, 1, 2)', "@ must stand once in its name"),
    ],
)
def test_names_that_are_taken_or_cannot_be_are_one_line(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "judge.py"
    path.write_text(f"from matbench import Family, Metric\nONE = {text}\n")
    with pytest.raises(UserError) as caught, plugins.using([path]):
        metric_catalogue.metrics()
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_family_may_make_what_is_no_metric(tmp_path: Path) -> None:
    path = tmp_path / "judge.py"
    path.write_text(
        JUDGE.replace('Metric(f"fine', 'Odd(f"fine')
        + "\n\nclass Odd:\n    def __init__(self, name, *_): self.name = name\n"
    )
    with plugins.using([path]), pytest.raises(UserError, match=r"family fine_@ made no matbench\.Metric for it"):
        metric_catalogue.metric_named("fine_1")


@pytest.mark.parametrize(
    ("asked", "meant"), [("D1", "d1"), ("RMS", "rms"), ("Bad_3", "bad_3"), ("TOTAL_BAD_0.7", "total_bad_0.7")]
)
def test_a_name_in_capital_letters_is_met_with_the_right_one(asked: str, meant: str) -> None:
    with pytest.raises(UserError, match=rf"unknown metric '{asked}': did you mean '{meant}'\?"):
        metric_catalogue.metric_named(asked)
