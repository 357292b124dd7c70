"""What the README and the pages in docs/ show: commands and code."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
README = ROOT / "README.md"
if not README.exists():
    pytest.skip("no README beside the tests", allow_module_level=True)
PAGES = (README, *sorted((ROOT / "docs").rglob("*.md")))
TEXT = {page.relative_to(ROOT).as_posix(): page.read_text() for page in PAGES}


def blocks(language: str, page: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", TEXT[page], re.DOTALL)


_COMMAND = re.compile(r"^    ((?:matbench|python \S+\.py) .*)$", re.M)
LINES = list(dict.fromkeys(line for text in TEXT.values() for line in _COMMAND.findall(text)))
"""Every command that stands in a line of its own, once."""

INLINE = sorted({" ".join(line.split()) for text in TEXT.values() for line in re.findall(r"`(matbench [^`]+)`", text)})
"""Every command within a sentence."""

METHOD = blocks("python", "README.md")[0]
SCENE = blocks("toml", "docs/guides/own-scene.md")[0]
SCRIPT = blocks("python", "docs/guides/own-method.md")[1]
CI_SCRIPT = blocks("python", "docs/guides/ci.md")[0]
