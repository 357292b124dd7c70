"""All numbers that a reader of the page can choose."""

import json
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
from attrs import evolve

from matbench.measures.statistics import paired_effect
from matbench.reports import numbers as numbers_module
from matbench.reports import tables
from matbench.reports.content import Report
from matbench.reports.numbers import Numbers, entries


@pytest.fixture
def numbers(report: Report) -> Numbers:
    labelled = evolve(report, results=tables.labelled(report.results), cells=tables.labelled(report.cells))
    return Numbers(labelled, tables.shared(report.results, report.cells))


def test_every_mean_of_every_metric_and_region_is_that_of_the_tables(numbers: Numbers, report: Report) -> None:
    assert set(numbers.means) == {"bad_1", "total_bad_1", "avg", "weight"}
    for metric, by_region in numbers.means.items():
        assert list(by_region) == numbers.regions
        for region, found in by_region.items():
            means = tables.means(report.results, numbers.scope, region, metric)
            for method, entry in found.items():
                assert entry[0] == pytest.approx(means[method])
                assert entry[1] == tables.text(means[method], numbers.units[metric])


def test_metrics_with_a_threshold_are_one_score(numbers: Numbers) -> None:
    assert numbers.scores == ["total_bad_@", "bad_@", "avg", "weight"]
    assert numbers.columns == ["total_bad_@", "bad_@", "avg", "seconds", "peak_mb", "weight"]
    assert (numbers.metric, numbers.region, numbers.threshold, numbers.thresholds) == ("total_bad_1", "all", "1", ["1"])
    assert numbers.metric_of(numbers.score("bad_1")) == "bad_1"
    assert numbers.score("avg") == "avg"


def test_thresholds_increase_as_numbers(numbers: Numbers) -> None:
    results = numbers.report.results
    more = [results[results["metric"] == "bad_1"].assign(metric=f"bad_{t}") for t in ("10", "2", "0.5")]
    wide = Numbers(evolve(numbers.report, results=pd.concat([results, *more])), numbers.scope)
    assert wide.thresholds == ["0.5", "1", "2", "10"]


def test_differences_are_paired_over_scenes_from_either_side(numbers: Numbers, report: Report) -> None:
    first, second = numbers.scope.methods[:2]
    table = tables.per_scene(report.results, "occ", "avg")
    expected = paired_effect(list(table[second] - table[first]))
    lines = {line["method"]: line for line in numbers.against("avg", "occ")}
    assert {line["reference"] for line in lines.values()} == {first}, "the best one"
    assert lines[second]["mean"] == tables.text(expected.mean, "%", signed=True)
    assert lines[second]["scenes"] == 2
    other = {line["method"]: line for line in numbers.against("avg", "occ", second)}
    assert other[first]["mean"] == tables.text(-expected.mean, "%", signed=True)


def test_the_script_is_given_what_json_can_hold(numbers: Numbers) -> None:
    data = json.loads(json.dumps(numbers.data(), allow_nan=False))
    assert data["methods"] == list(numbers.scope.methods)
    assert data["means"] == numbers.means
    assert set(data["counts"]) == set(numbers.units)


def test_entries_hold_number_text_and_place() -> None:
    values = pd.Series({"a": 2.0, "b": 1.0, "c": np.nan, "d": np.inf, "e": 0.5})
    ranked = pd.Series({"a": True, "b": True, "c": True, "d": False, "e": True})
    answered = pd.Series({"a": 100.0, "b": 95.0, "c": 100.0, "d": 100.0, "e": 1.0})
    found = entries(values, ranked, "%", answered=answered)
    assert found["a"] == [2.0, "2.00", 2]
    assert found["b"][:3] == [1.0, "1.00", 1], "who answers enough may win"
    assert found["b"][3].endswith("answered")
    assert (found["c"][0], found["c"][2]) == (None, 0)
    assert (found["d"][0], found["d"][2]) == (1e300, 0)
    assert (found["e"][2], found["e"][3][-10:]) == (tables.NOT_RANKED, "not ranked")
    higher = entries(values[["a", "b"]], ranked[["a", "b"]], "%", "higher")
    assert [higher[m][2] for m in "ab"] == [1, 2]


def test_of_very_many_scenes_some_are_shown_from_the_easiest_to_the_hardest(report: Report) -> None:
    table, names = report.results, [f"made/s{k}" for k in range(700)]
    first = table[table["scene"] == table["scene"].iloc[0]]
    results = pd.concat([first.assign(scene=name, value=first["value"] + k) for k, name in enumerate(names)])
    row = report.cells[(report.cells["scene"] == table["scene"].iloc[0]) & (report.cells["status"] == "ok")]
    cells = pd.concat([row.assign(scene=name) for name in names])
    many = evolve(report, results=tables.labelled(results), cells=tables.labelled(cells))
    numbers = Numbers(many, tables.shared(many.results, many.cells))
    count = numbers_module.SHOWN // len(numbers.scope.methods)
    assert len(numbers.shown) == count
    assert {names[0], names[-1]} <= set(numbers.shown)
    assert numbers.counts["total_bad_1"]["all"] == 700, "means are over all"
    places = [names.index(name) for name in numbers.shown]
    assert max(b - a for a, b in pairwise(places)) <= 5
