"""What the README and the pages in docs/ show: commands and code."""

import re

import pytest
from places import ROOT

README = ROOT / "README.md"
if not README.exists():
    pytest.skip("no README beside the tests", allow_module_level=True)
PAGES = (README, *sorted((ROOT / "docs").rglob("*.md")))
TEXT = {page.relative_to(ROOT).as_posix(): page.read_text() for page in PAGES}


def blocks(language: str, page: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", TEXT[page], re.DOTALL)


_ALONE = re.compile(r"^    ((?:.* && )?(?:matbench|pip|python3?)(?: .*)?)$", re.M)


def commands(page: str) -> list[str]:
    """The commands of a page that stand in lines of their own, in order."""
    return _ALONE.findall(TEXT[page])


_WITHIN = re.compile(r"`(matbench [^`]+)`")
LINES = list(
    dict.fromkeys(
        [line for text in TEXT.values() for line in _ALONE.findall(text)]
        + [" ".join(line.split()) for text in TEXT.values() for line in _WITHIN.findall(text)]
    )
)
"""Every command, once: those in a line of their own, then those within sentences."""

METHOD = blocks("python", "README.md")[0]
SCENE = blocks("toml", "docs/guides/own-scene.md")[0]
GROUPS = blocks("python", "docs/guides/own-method.md")[1]
SWEEP = blocks("python", "docs/guides/own-method.md")[-2]
SCRIPT = blocks("python", "docs/guides/own-method.md")[-1]
OWN_FILES = dict(re.findall(r"`(\w+\.py)`:\n\n```python\n(.*?)```", TEXT["docs/guides/extending.md"], re.DOTALL))
"""The files that the page on extending has one write: name -> content."""
CI_SCRIPT = blocks("python", "docs/guides/ci.md")[0]
