"""Errors over coverage: a line for each method with confidence, every scene counted once, all inside of the picture."""

import pandas as pd
import pytest

from matbench.reports.confidence_figure import caption, comparable, curves, draw, figure, scenes_of
from matbench.reports.tables import Shared

LONG = "m[some=parameter another=$value_ and=more of=them and=still more=here]"


def points(**risks: dict[str, list[float]]) -> pd.DataFrame:
    """Method -> scene -> risks at even coverages."""
    rows = [
        (method, scene, 100 * (k + 1) / len(values), value, 0.0)
        for method, scenes in risks.items()
        for scene, values in scenes.items()
        for k, value in enumerate(values)
    ]
    return pd.DataFrame(rows, columns=["algorithm", "scene", "coverage", "risk", "best"]).assign(params="")


def test_scenes_count_once_whatever_their_seeds() -> None:
    table = points(a={"s": [1.0, 3.0]}, b={"s": [9.0, 9.0]})
    seeds = [table, points(a={"s": [3.0, 5.0], "t": [8.0, 8.0]})]
    found = curves(pd.concat(seeds), ["b", "a", "silent"])
    assert list(found) == ["b", "a"]
    assert found["a"]["coverage"].tolist() == [50, 100]
    assert found["a"]["risk"].tolist() == [5, 6]  # s: 2 and 4, t: 8 and 8


@pytest.mark.parametrize("width", ["column", "page"])
def test_every_method_has_its_line_and_its_name_inside(width: str) -> None:
    table = points(a={"s": [1.0, 3.0]}, b={"s": [2.0, 9.0]}, **{LONG: {"s": [0.5, 0.7]}})
    drawn = draw(curves(table, ["a", "b", LONG]), (1, 1), width)  # type: ignore[arg-type]
    drawn.figure.draw_without_rendering()
    (axes,) = drawn.figure.axes
    assert len(axes.lines) == 6, "a line and its best for each"
    frame, (legend,) = drawn.figure.bbox, drawn.figure.legends
    said = [axes.xaxis.label, axes.yaxis.label, *legend.get_texts()]
    assert len(said) == 5
    for text in said:
        box = text.get_window_extent()
        assert frame.x0 <= box.x0 < box.x1 <= frame.x1, text.get_text()
        assert frame.y0 <= box.y0 < box.y1 <= frame.y1, text.get_text()


def test_nothing_to_show_is_no_figure() -> None:
    assert curves(points(), ["a"]) == {}
    assert figure({}) is None


def test_the_caption_counts_scenes() -> None:
    assert "over 1 scene," in caption(1, 1)
    assert "over 12 scenes," in caption(12, 12)
    assert "over 1 to 2 scenes," in caption(1, 2)


def test_only_scenes_that_the_methods_share_count() -> None:
    level = {scene: [float(n), float(n)] for n, scene in enumerate("stu")}
    table = points(a=level, b={"s": [4.0, 4.0], "t": [4.0, 4.0]}, few={"t": [9.0, 9.0]})
    has = {"a": frozenset("stu"), "b": frozenset("stu"), "few": frozenset("t")}
    kept = comparable(table, Shared(("a", "b", "few"), tuple("stu"), has, ("s", "t")))
    found = curves(kept, ["a", "b", "few"])
    assert found["a"]["risk"].tolist() == [0.5, 0.5], "u is no scene of the others"
    assert found["few"]["risk"].tolist() == [9, 9], "its own, as it is not ranked"
    assert scenes_of(kept, found) == (1, 2)
    assert scenes_of(kept, ["b"]) == (2, 2)
