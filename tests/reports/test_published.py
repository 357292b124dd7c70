"""Scores as published, beside measured ones."""

import csv
import io

import pandas as pd
import pytest

from matbench import load_scene
from matbench.errors import UserError
from matbench.reports import paper, published, terminal

PAIR = "middlebury2003/teddy[views=im2+im6]"


def tables(*scenes: str, pixels: int = 150_000) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Results and cells of two methods: `worse` is one per cent worse in every region."""
    keys = [(m, s) for m in ("worse", "better") for s in scenes]
    cells = pd.DataFrame(
        [{"algorithm": m, "params": "", "scene": s, "seed": 0, "status": "ok", "seconds": 1.0} for m, s in keys]
    )
    results = pd.DataFrame(
        [
            {"algorithm": m, "params": "", "scene": s, "seed": 0, "view": "2", "region": r, "metric": "total_bad_1"}
            | {"value": 10.0 + (m == "worse"), "unit": "%", "pixels": pixels, "answered": 100.0}
            for m, s in keys
            for r in ("nonocc", "all", "occ", "disc")
        ]
    )
    return results, cells


def test_every_row_says_where_it_is_from_and_how_it_is_known() -> None:
    rows = published._rows()
    assert (rows != "").all(axis=None)
    assert set(rows["known"]) == {"read", "remembered"}
    assert not rows.duplicated(["method", "scene", "region", "metric"]).any()
    assert set(rows["scene"]) <= {scene for one in published._protocols().values() for scene in one["scenes"]}
    assert set(rows["protocol"]) == set(published._protocols())
    assert rows["value"].astype(float).between(0, 100).all()


@pytest.mark.parametrize(
    ("scene", "why"),
    [
        (PAIR, None),
        ("middlebury2003/teddy[views=2+6]", None),
        ("middlebury2003/teddy[disparities=0:59 views=im2+im6]", None),
        ("middlebury2001/venus[disparities=0:19 views=im2+im6]", None),
        ("middlebury2003/teddy", "of two views only"),
        ("middlebury2003/teddy[views=im1+im5]", "of two views only"),
        ("middlebury2003/teddy[views=im6+im2]", "of two views only"),
        ("middlebury2001/venus[views=im2+im6]", "of the range 0:19"),
        ("middlebury2003/teddy[disparities=0:60 views=im2+im6]", "of the range 0:59"),
        ("middlebury2003/teddy[size=half views=im2+im6]", "without size"),
        ("middlebury2003/teddy[ref=im6 views=im2+im6]", "without ref"),
        ("synthetic/box", "no published rows of synthetic/box"),
    ],
)
def test_only_the_very_same_protocol_will_do(scene: str, why: str | None) -> None:
    found = published.refusal(scene)
    assert (found is None) == (why is None)
    assert why is None or (why in str(found) and scene in str(found))


@pytest.mark.parametrize("protocol", sorted(published._protocols()))
def test_a_refusal_names_a_scene_that_is_not_refused(protocol: str) -> None:
    for scene in published._protocols()[protocol]["scenes"]:
        named = str(published.refusal(scene)).rpartition(": ")[2]
        assert published.refusal(named) is None


@pytest.mark.parametrize("scene", ["middlebury2001/tsukuba", "middlebury2001/venus", "middlebury2003/teddy"])
def test_the_protocol_is_that_of_the_scene_as_loaded(scene: str) -> None:
    try:
        load_scene(scene)
    except UserError as error:
        pytest.skip(str(error))
    facts = published._protocol(scene)["scenes"][scene]  # type: ignore[index]
    loaded = load_scene(str(published.refusal(scene)).rpartition(": ")[2])
    low, high = map(float, facts["range"].split(":"))
    assert (loaded.n, loaded.ref, loaded.disparities.least, loaded.disparities.largest) == (2, 0, low, high)
    assert [loaded.width, loaded.height] == facts["size"]


def test_published_rows_stand_below_the_measured_ones_without_a_place() -> None:
    made = published.beside(*tables(PAIR, "synthetic/box"))
    (block,) = made.blocks
    lines = list(block.lines())
    assert [(old, texts[0]) for old, texts in lines[:3]] == [(False, "better"), (False, "worse"), (True, "SSD+MF")]
    assert block.heads == ["method", "nonocc", "all", "disc", "source"]
    assert {texts[0]: texts[1:-1] for _, texts in lines}["AdaptingBP"] == ["4.22", "7.06", "11.8"]
    assert {texts[0]: texts[1:-1] for _, texts in lines}["SGM"] == ["6.02", "–", "–"]
    remarks = {texts[0]: texts[-1] for _, texts in lines}
    assert remarks["AdaptingBP"] == "Klaus, Sormann & Karner 2006; remembered in all, disc"
    assert remarks["PatchMatch"] == "Bleyer, Rhemann & Rother 2011"
    assert made.refused == ("synthetic/box: no published rows of synthetic/box are known",)


def test_every_format_has_the_same_published_numbers() -> None:
    results, cells = tables(PAIR)
    made = published.beside(results, cells)
    sheet = paper.sheet(results, cells)
    expected = [texts for old, texts in made.blocks[0].lines() if old]
    rows = list(csv.reader(io.StringIO(published.appended(paper.formatted(sheet, "csv"), made, "csv"))))
    at = {head: place for place, head in enumerate(rows[0])}
    old = [row for row in rows if row[at["note"]].startswith("published: ")]
    shown = [[row[at[head]] or "–" for head in ("method", "nonocc", "all", "disc")] for row in old]
    assert shown == [texts[:-1] for texts in expected]
    assert all(len(row) == len(rows[0]) for row in rows)
    md, tex = (published.appended(paper.formatted(sheet, f), made, f) for f in ("md", "tex"))
    for texts in expected:
        numbers = [text for text in texts[1:-1] if text != "–"]
        assert any(all(f"*{n}*" in line for n in numbers) for line in md.splitlines() if texts[0] in line)
        assert any(all(n in line for n in numbers) for line in tex.splitlines() if paper.tex(texts[0]) in line)
    assert md.startswith(paper.formatted(sheet, "md"))


def test_the_terminal_shows_them_dimmed() -> None:
    (table,) = published.terminal(published.beside(*tables(PAIR)))
    styles = [row.style for row in table.rows]
    assert styles[:2] == ["", ""]
    assert set(styles[2:]) == {"dim"}
    assert isinstance(table, type(terminal.plain("")))


def test_pictures_of_another_size_are_no_part_of_it() -> None:
    made = published.beside(*tables(PAIR, pixels=600_000))
    assert made.blocks == ()
    assert made.refused == (f"{PAIR}: published rows are of 450x375 pixels",)


@pytest.mark.parametrize(
    ("scenes", "metric", "said"),
    [
        (["synthetic/box"], "total_bad_1", "no published rows to show: synthetic/box"),
        (["middlebury2003/teddy", "synthetic/box"], "total_bad_1", "1 more scene has none"),
        ([PAIR], "bad_2", "known by total_bad_1 only, not by bad_2"),
    ],
)
def test_where_there_are_none_one_line_says_why(scenes: list[str], metric: str, said: str) -> None:
    with pytest.raises(UserError, match=said):
        published.check(scenes, metric)
