"""Who answers little is shown and told, and wins nothing: terminal, page, paper, document, curves and switches."""

import io
import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from rich.console import Console

from matbench.cli import main
from matbench.reports import page, paper, standing, tables, terminal
from matbench.reports.content import Report
from matbench.reports.numbers import Numbers
from matbench.results.comparable import SILENT

SCENES = [f"made/s{i}" for i in range(6)]
ANSWERED = {"good": 100.0, "fair": 95.0, "sparse": 1.0, "silent": 0.0}
BAD = {"good": 8.0, "fair": 9.0, "sparse": 0.25, "silent": 0.0}

PLUGIN = """
import numpy as np
from matbench import Estimate

def answer(scene, share):
    rows = np.full((scene.height, scene.width), scene.disparities.largest, np.float32)
    rows[int(round(share * scene.height)):] = np.nan
    return Estimate({scene.ref: rows})

class Silent:
    def solve(self, scene, context):
        return answer(scene, 0)

class Half:
    def solve(self, scene, context):
        return answer(scene, 0.5)

class Wild:
    def solve(self, scene, context):
        found = answer(scene, 1)
        found.disparity[scene.ref][3, 3] = 1e38
        return found
"""


def run() -> tuple[pd.DataFrame, pd.DataFrame]:
    rows, cells = [], []
    for (method, share), scene in ((one, scene) for one in ANSWERED.items() for scene in SCENES):
        values = {
            "bad_1": (BAD[method], "%", share),
            "total_bad_1": (100 - share + BAD[method], "%", 100.0),
            "invalid": (100 - share, "%", 100.0),
            "avg": (BAD[method] / 10 if share else np.nan, "px", share),
        }
        for region in ("all", "nonocc"):
            for metric, (value, unit, answered) in values.items():
                rows.append((method, "", scene, "0", 0, region, metric, value, unit, 900, answered))
        cells.append((method, "", scene, 0, "ok", 1.0, 10.0, ""))
    heads = ["algorithm", "params", "scene", "view", "seed", "region", "metric", "value", "unit", "pixels", "answered"]
    costs = ["algorithm", "params", "scene", "seed", "status", "seconds", "peak_mb", "reason"]
    return pd.DataFrame(rows, columns=heads), pd.DataFrame(cells, columns=costs)


def test_the_summary_ranks_who_answers() -> None:
    rows = tables.summary(*run(), "bad_1")
    assert rows.index.tolist() == ["good", "fair", "silent", "sparse"]
    assert rows["ranked"].tolist() == [True, True, False, False]
    assert rows["remark"].tolist() == [
        "",
        "answers 95 %",
        "not ranked; no answer anywhere",
        "not ranked; answers 1 %",
    ]
    assert tables.summary(*run())["ranked"].all(), "total_bad counts silence itself"


def test_the_terminal_marks_and_explains() -> None:
    console = Console(file=io.StringIO(), width=80, record=True, force_terminal=True)
    for table in terminal.tables(*run(), "bad_1"):
        console.print(table)
    text = console.export_text(styles=True)
    assert "\x1b[1m8.00" in text, "the best is bold"
    assert "\x1b[1m0.00" not in text
    assert "0.00*" in text
    assert "0.25*" in text
    assert "fewer than 90 % are answered: shown, not ranked" in text.replace("\n", " ")


@pytest.mark.parametrize("format", paper.FORMATS)
def test_a_paper_says_the_same(format: paper.Format) -> None:
    made = paper.sheet(*run(), "bad_1")
    text = paper.formatted(made, format)
    means = made.texts[made.texts["scene"] == paper.MEAN].set_index("method")
    assert means["mean rank"].to_dict() == {"good": "1.00", "fair": "2.00", "silent": "–", "sparse": "–"}
    if format == "csv":
        assert 'mean,silent,0.00,0.00,,bad_1,%,"answers too little in nonocc, all"' in text
    else:
        starred = {"tex": "0.25* & 0.25* & --", "md": r"0.25\* | 0.25\* | –"}[format]
        assert starred in " ".join(text.split())
        assert "silent: no answer anywhere" in text
        assert "fewer than 90" in text
    assert {"tex": r"\textbf{8.00}", "md": "**8.00**", "csv": "8.00"}[format] in text


def test_the_page_and_what_its_script_is_given() -> None:
    results, cells = (tables.labelled(frame) for frame in run())
    report = Report("run", "matbench compare", results, cells)
    numbers = Numbers(report, tables.shared(results, cells))
    assert numbers.means["bad_1"]["all"] == {
        "good": [8.0, "8.00", 1],
        "fair": [9.0, "9.00", 2, "95 % answered"],
        "sparse": [0.25, "0.25", tables.NOT_RANKED, "1 % answered, not ranked"],
        "silent": [0.0, "0.00", tables.NOT_RANKED, "0 % answered, not ranked"],
    }
    assert numbers.means["avg"]["all"]["sparse"][2] == tables.NOT_RANKED
    assert numbers.scenes["bad_1"]["all"][0][3][2] == tables.NOT_RANKED
    assert numbers.ranks["bad_1"]["all"]["silent"][0] is None
    assert numbers.aside["bad_1"]["all"] == ["sparse", "silent"]
    assert numbers.data()["aside"]["total_bad_1"] == {}
    lines = {line["method"]: line for line in numbers.against("bad_1", "all")}
    assert {line["reference"] for line in lines.values()} == {"good"}, "not the silent one"
    assert {m: line["verdict"] for m, line in lines.items()} == {"fair": "worse", "sparse": SILENT, "silent": SILENT}
    html = page.render(report)
    assert "<b>silent</b>: no answer anywhere" in html
    assert "answers less than 90&nbsp;% is not ranked by it" in html


def test_ranks_are_among_those_who_answer() -> None:
    results, cells = (tables.labelled(frame) for frame in run())
    table, scope = tables.per_scene(results, "all", "bad_1"), tables.shared(results, cells)
    assert standing.mean_ranks(table, scope, "%", False)["silent"] == 1
    found = standing.mean_ranks(table, scope, "%", False, ["sparse", "silent"])
    assert found["good"] == 1
    assert np.isnan(found["silent"])


def test_a_real_run_from_end_to_end(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "mine.py").write_text(PLUGIN)
    words = ["compare", "--plugin", str(tmp_path / "mine.py"), "-a", "silent", "-a", "half", "-a", "wild", "-a", "sgbm"]
    words += ["-s", "synthetic/box[size=96x72]", "--out", str(tmp_path / "run"), "-m", "bad_1", "--json"]
    with pytest.raises(SystemExit) as ended:
        main(words)
    assert ended.value.code == 0
    document = json.loads(capsys.readouterr().out)
    rows = {row["method"]: row for row in document["table"]}
    assert [row["method"] for row in document["table"]][-2:] == ["silent", "half"]
    assert not rows["silent"]["ranked"]
    assert rows["silent"]["remark"] == "not ranked; no answer anywhere"
    assert rows["half"]["answered"]["all"] == pytest.approx(50)
    assert rows["half"]["answers"] == pytest.approx(50)
    assert rows["sgbm"]["ranked"]
    assert document["counted"]["all"] == 1
    assert document["clock"] == "wall"
    assert rows["wild"]["avg"] > 1e30
    kept = pd.read_csv(tmp_path / "run" / "results.csv")
    whole = kept[(kept["algorithm"] == "half") & (kept["region"] == "all")].set_index("metric")
    assert whole.loc[["bad_1", "avg", "a99", "total_bad_1", "invalid"], "answered"].tolist() == [50, 50, 50, 100, 100]
    with pytest.raises(SystemExit):
        main(["report", str(tmp_path / "run"), "-m", "avg"])
    printed = capsys.readouterr().out
    assert "…" not in printed, "a pixel of 1e38 takes no room from the others"
    assert max(map(len, printed.splitlines())) <= 80
    for name in ("silent", "half", "wild", "sgbm", "e+3"):
        assert name in printed
