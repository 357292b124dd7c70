"""The critical-difference diagram: every method and rank is named, and nothing lies outside of the picture."""

import pytest

from matbench.reports.rank_figure import caption, draw, figure
from matbench.reports.standing import Ranking

LONG = "m[some=parameter another=$value_ and=more of=them]"
RANKING = Ranking({"best": 1.2, LONG: 2.0, "third_method": 2.8, "last": 4.0}, 24, 0.9, 1e-9)


@pytest.mark.parametrize("width", ["column", "page"])
def test_all_names_and_ranks_stand_inside(width: str) -> None:
    drawn = draw(RANKING, "total_bad_1", "all", width)  # type: ignore[arg-type]
    drawn.figure.canvas.draw()
    (axes,) = drawn.figure.axes
    said = [text.get_text() for text in axes.texts]
    for name, rank in (("best", "1.20"), ("third", "2.80"), ("last", "4.00"), ("m[", "2.00")):
        assert sum(name in text and rank in text for text in said) == 1
    frame = drawn.figure.bbox
    for text in axes.texts:
        box = text.get_window_extent()
        assert frame.x0 <= box.x0 < box.x1 <= frame.x1, text.get_text()
        assert frame.y0 <= box.y0 < box.y1 <= frame.y1, text.get_text()
    bars = [line for line in axes.lines if line.get_linewidth() == 3]
    assert len(bars) == len(RANKING.alike) == 2


def test_two_methods_have_a_diagram_too() -> None:
    assert figure(Ranking({"a": 1.4, "b": 1.6}, 9, 5.0, 0.5)).axes


def test_the_caption_names_the_tests() -> None:
    said = caption(RANKING, "avg", "occ")
    for words in ("avg in occ over 24 scenes", "0.90 (Nemenyi, 95 %)", "p < 0.001"):
        assert words in said
