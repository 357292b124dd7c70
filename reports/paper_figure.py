"""What all figures for papers share: the size of a column, the look, the files, the captions."""

import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

from attrs import frozen

from matbench import drawing
from matbench._moved import moved_name
from matbench.files.writing import write_bytes, write_text
from matbench.reports.paper import tex

if TYPE_CHECKING:
    from matplotlib.figure import Figure
else:
    __getattr__ = partial(moved_name, __name__)

Width = Literal["column", "page"]
INCHES: dict[Width, float] = dict(zip(get_args(Width), (3.25, 6.875), strict=True))
TALLEST = 9.0  # inches: what a page holds
DOTS = 600  # of a PNG, per inch
_LOOK = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],  # comes with matplotlib: the same letters everywhere
    "font.size": 7,
    "axes.titlesize": 7,
    "axes.labelsize": 7,
    "xtick.labelsize": 6.5,
    "ytick.labelsize": 6.5,
    "axes.linewidth": 0.5,
    "xtick.major.width": 0.5,
    "ytick.major.width": 0.5,
    "xtick.major.size": 2,
    "ytick.major.size": 2,
    "axes.titlepad": 2.5,
    "pdf.fonttype": 42,  # TrueType, embedded: what publishers ask for
    "image.interpolation": "none",  # pixels stay pixels
    "savefig.dpi": DOTS,
}


@frozen(eq=False)
class CaptionedFigure:
    """A figure with its caption.

    Parameters
    ----------
    caption
        In plain words; panels by their letters.
    """

    figure: "Figure"
    caption: str


@contextmanager
def small_print() -> Iterator[None]:
    """A context in which figures are drawn and saved with the small print of a paper."""
    with drawing.style(_LOOK):
        yield


def letter(number: int) -> str:
    """The letter of a panel: 0 -> "a", 26 -> "aa".

    >>> letter(0), letter(27)
    ('a', 'ab')
    """
    return (letter(number // 26 - 1) if number >= 26 else "") + chr(ord("a") + number % 26)


def write_figure(drawn: CaptionedFigure, stem: Path) -> list[Path]:
    """Write a figure as PDF and PNG, its caption as text, and LaTeX that includes both; the four paths."""
    paths = [stem.with_name(stem.name + ending) for ending in (".pdf", ".png", ".txt", ".tex")]
    for path in paths[:2]:
        out = io.BytesIO()
        undated = {"CreationDate": None} if path.suffix == ".pdf" else {}
        with small_print():
            drawn.figure.savefig(out, format=path.suffix[1:], metadata=undated)
        write_bytes(path, out.getvalue())
    write_text(paths[2], drawn.caption + "\n")
    write_text(paths[3], _include(drawn, stem.name))
    return paths


def _include(drawn: CaptionedFigure, name: str) -> str:
    """The LaTeX that a paper inputs."""
    width = drawn.figure.get_figwidth()
    kind = "figure" if width <= INCHES["column"] else "figure*"
    label = re.sub("[^A-Za-z0-9]+", "-", name).strip("-")
    return f"""% needs \\usepackage[T1]{{fontenc}}, \\usepackage{{textcomp}} and \\usepackage{{graphicx}}
\\begin{{{kind}}}
\\centering
\\includegraphics[width={width:g}in]{{{name}}}
\\caption{{{tex(drawn.caption)}}}
\\label{{fig:{label}}}
\\end{{{kind}}}
"""
