"""The page: one file, nothing hostile gets through, its numbers are the tables' numbers."""

import json
import re
import time
from collections.abc import Sequence
from html import unescape
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from attrs import evolve

from matbench.reports import page, tables
from matbench.reports.content import Report


class Reader(HTMLParser):
    """Collects tags with their attributes, and the texts of scripts and table cells."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.scripts: list[str] = []
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag == "script":
            self.scripts.append("")

    def handle_data(self, data: str) -> None:
        if self.lasttag == "script" and self.tags[-1][0] == "script":
            self.scripts[-1] += data


def data_of(html: str) -> Any:
    return json.loads(Reader(html).scripts[0], parse_constant=lambda c: pytest.fail(f"{c} is not JSON"))


def test_one_file_without_addresses(report: Report, tmp_path: Path) -> None:
    page.write_page(tmp_path / "report.html", report)
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]
    html = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "http:" not in html
    assert "https:" not in html
    for tag, attributes in Reader(html).tags:
        assert tag not in ("link", "iframe", "object", "base")
        for name in ("src", "href", "xlink:href"):
            assert (attributes.get(name) or "#").startswith(("#", "data:image/webp;base64,", "data:image/png;base64,"))


def test_hostile_names_stay_text(report: Report) -> None:
    html = page.render(report)
    assert "<script>alert" not in html
    assert len(Reader(html).scripts) == 2
    assert {m for m, _ in Reader(html).tags if m == "script"} == {"script"}
    assert "alert(1)" in unescape(html)
    data = data_of(html)
    assert "<script>alert(1)</script>[a=</script><!--]" in data["methods"]
    for _, attributes in Reader(html).tags:
        assert not any(name.startswith("on") for name in attributes)


def test_numbers_are_those_of_the_tables(report: Report) -> None:
    html = page.render(report)
    data, rows = data_of(html), tables.summary(report.results, report.cells)
    for method, row in rows.iterrows():
        for region in tables.REGIONS:
            value, shown, _ = data["means"]["total_bad_1"][region][method]
            assert value == pytest.approx(row[f"total_bad_1 {region}"])
            assert shown == tables.text(value, "%")
            assert f">{shown}<" in html
    scenes = tables.per_scene(report.results, "mine", "weight")
    for entries, (_, row) in zip(data["scenes"]["weight"]["mine"], scenes.iterrows(), strict=True):
        for method, (value, _, _) in zip(data["methods"], entries, strict=True):
            assert value == pytest.approx(row[method]) if value is not None else np.isnan(row[method])


def test_failed_cells_are_shown_and_not_ranked(report: Report) -> None:
    html = page.render(report)
    assert "Cells without a score" in html
    assert "ValueError: &lt;script&gt;" in html
    assert "not ranked: 1 of 2 scenes" in html
    entries = data_of(html)["scenes"]["total_bad_1"]["all"][1]
    assert entries[-1] == [None, "failed", 0]
    assert data_of(html)["means"]["total_bad_1"]["all"]["broken[x=[1] \"'&]"][2] == 0


def test_the_answer_is_honest(report: Report) -> None:
    html = page.render(report)
    words = " ".join(re.sub(r"<[^>]+>", "", unescape(html)).split())
    assert "good has the lowest total_bad_1 in all on 2 scenes: 10.51" in words
    assert "too few scenes to conclude" in html


@pytest.mark.parametrize(("gaps", "decided"), [((3, -2.5, 3, -2, 3, -2), False), ((3, 1, 2, 1, 2, 3), True)])
def test_a_lead_that_scenes_do_not_decide_is_told_with_the_winner(
    report: Report, gaps: Sequence[float], decided: bool
) -> None:
    made = [
        ("sgbm", "", f"made/{number}", "b", 0, "all", "total_bad_1", 9.0 + gap * place, "%", 100)
        for number, gap in enumerate(gaps)
        for place in (0, 1)
    ]
    results = pd.DataFrame(made, columns=report.results.columns)
    results.loc[1::2, "algorithm"] = "other"
    cells = results[["algorithm", "params", "scene", "seed"]].assign(status="ok", seconds=1.0, peak_mb=1.0, reason="")
    html = page.render(evolve(report, results=results, cells=cells, maps={}, scenes={}))
    assert "ahead of <b>other</b>" in html
    assert ("do not decide" not in html) == decided


@pytest.mark.parametrize("keep_cells", [True, False])
def test_no_results(report: Report, keep_cells: bool) -> None:
    cells = report.cells.assign(status="failed", seconds=None) if keep_cells else report.cells.iloc[:0]
    html = page.render(evolve(report, results=report.results.iloc[:0], cells=cells, maps={}))
    assert "There is nothing to compare" in html
    assert data_of(html)["units"] == {}


def test_no_columns_but_those_promised(report: Report) -> None:
    empty = evolve(report, results=pd.DataFrame(columns=report.results.columns), cells=report.cells.assign(extra=1))
    assert "nothing to compare" in page.render(empty)


def test_maps_may_be_a_function_and_scenes_unknown(report: Report) -> None:
    called = evolve(report, maps=report.disparity)
    assert page.render(called) == page.render(report)
    assert page.render(evolve(report, scenes={})).count("no maps") == 2


def test_ten_methods_on_ten_scenes_of_quarter_size_stay_below_15_MB(report: Report, tmp_path: Path) -> None:
    """Maps with sub-pixel noise in every pixel, a tenth of a pixel of the pair."""
    random = np.random.default_rng(0)
    scenes, maps = {}, {}
    template, methods = next(iter(report.scenes.values())), [f"method_{k}" for k in range(10)]
    waves = np.add.outer(np.sin(np.arange(375) / 40), np.cos(np.arange(450) / 60))
    for k in range(10):
        truth = (8 + 3 * waves + k).astype(np.float32)
        views = np.repeat(np.rint(30 * truth / 3 + 3 * random.normal(size=(7, 375, 450)))[..., None], 3, axis=3)
        scenes[f"made/{k}"] = evolve(
            template,
            name=f"made/{k}",
            views=views.clip(0, 255).astype(np.uint8),
            labels=tuple("abcdefg"),
            disparities=type(template.disparities)(0, 30),
            truth={1: truth},
            regions={"all": np.isfinite(truth)},
        )
        for method in methods:
            noise = random.normal(0, 0.05, truth.shape).astype(np.float32)
            maps[method, "", f"made/{k}", 0] = truth + noise
    first = report.results[(report.results["algorithm"] == "good") & (report.results["scene"] == "made/one")]
    ran = report.cells.iloc[[0]]
    both = [(m, s) for m in methods for s in scenes]
    results = pd.concat([first.assign(algorithm=m, scene=s) for m, s in both])
    cells = pd.concat([ran.assign(algorithm=m, scene=s) for m, s in both])
    before = time.process_time()
    page.write_page(tmp_path / "report.html", evolve(report, results=results, cells=cells, maps=maps, scenes=scenes))
    size = (tmp_path / "report.html").stat().st_size
    print(f"{size / 1e6:.1f} MB, {time.process_time() - before:.1f} s of CPU time")
    assert size < 15e6


def test_regions_over_all_views_stand_in_the_summary(report: Report) -> None:
    more = report.results[report.results["region"] == "mine"].assign(region="half_occluded", value=77.125)
    html = page.render(evolve(report, results=pd.concat([report.results, more])))
    assert "half_" in html
    data = data_of(html)
    assert list(data["means"]["bad_1"]) == [*tables.REGIONS, "half_occluded", "mine"]
    assert {shown for _, shown, _ in data["means"]["bad_1"]["half_occluded"].values()} == {"77.12"}
    assert html.count(">77.12<") >= len(data["methods"])


def test_calibration_is_drawn_where_volumes_were_kept(report: Report) -> None:
    assert "Calibration of" not in page.render(report)
    hostile = "<script>alert(1)</script>"
    curve = {"materiality": [0.05, 0.9], "observed": [0.0, 1.0], "points": [9000, 300]}
    curves = pd.DataFrame({"algorithm": hostile, "params": "a=$1", "scene": "made/one", "seed": 0, **curve})
    html = page.render(evolve(report, reliability=curves))
    assert "Calibration of materialities" in html
    assert "share of points with a surface" in html
    assert hostile not in html
    assert "Calibration of" not in page.render(evolve(report, reliability=curves.iloc[:0]))


def test_parameters_stand_in_their_groups(report: Report) -> None:
    names = str(report.cells["algorithm"].iloc[0]), str(report.cells["params"].fillna("").iloc[0])
    one = evolve(
        report,
        parameters={names: {"passes": 1, "window": 5, "fill": True}},
        groups={names[0]: {"passes": "fixed_point", "window": "matching"}},
    )
    told = page.render(one).partition("<summary>all parameters</summary>")[2].partition("</details>")[0]
    assert re.sub("</?(p|code)>", "", told).split() == [
        "fill=True",
        "fixed",
        "point:",
        "passes=1",
        "matching:",
        "window=5",
    ]
