"""Optional tools of the tests, each looked for in one place: without one, its tests are skipped.

MATBENCH_TESTS_NEED names those that must be there, as in ``tex,dask``: without one of these, its tests fail. A job that
is meant to have them sets it.
"""

import os
import shutil
from collections.abc import Iterable
from importlib.util import find_spec

import pytest

VARIABLE = "MATBENCH_TESTS_NEED"
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
ADVICE = {
    "tex": "no TeX with booktabs (Debian: apt-get install texlive-latex-recommended)",
    "browser": "no Chromium with chromedriver (Debian: apt-get install chromium chromium-driver)",
    "compiler": "no C compiler (Debian: apt-get install gcc libc6-dev)",
    "dask": "no Dask (pip install 'matbench-stereo[cluster]')",
    "onnx": "no onnxruntime, or no onnx (pip install 'matbench-stereo[onnx]' onnx)",
    "mccnn": "no mccnn (pip install 'matbench-stereo[mccnn]')",
    "torch": "no torch (pip install torch)",
}
"""Tool -> what a test that is skipped says."""
LIBRARIES = {"dask": ["distributed"], "onnx": ["onnxruntime", "onnx"], "mccnn": ["mc_cnn"], "torch": ["torch"]}
"""Tool -> the libraries that it is, if it is no program."""


def find(tool: str) -> list[str]:
    """The programs of a tool, or the library that it is; none if it is not there."""
    if tool in LIBRARIES:
        return LIBRARIES[tool] if all(map(find_spec, LIBRARIES[tool])) else []
    wanted: dict[str, tuple[Iterable[str], ...]] = {
        "tex": (["pdflatex"],),
        "browser": (BROWSERS, ["chromedriver"]),
        "compiler": (["gcc", "cc"],),
    }
    found = [next(filter(None, map(shutil.which, names)), None) for names in wanted[tool]]
    return [one for one in found if one] if all(found) else []


def need(tool: str) -> list[str]:
    """What `find` has found; without it the test that asks is skipped, or fails if the tool must be there."""
    if found := find(tool):
        return found
    if tool in os.environ.get(VARIABLE, "").split(","):
        pytest.fail(f"{ADVICE[tool]}, and {VARIABLE} asks for it", pytrace=False)
    pytest.skip(ADVICE[tool])
