"""What the README and the documentation name exists, nothing that they show is left out, and the site builds."""

import html
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from following import GROUPS
from shown import INLINE, LINES, PAGES, ROOT, TEXT

from matbench.cli import app


@pytest.mark.parametrize("line", LINES, ids=str)
def test_commands_are_run_in_one_way(line: str) -> None:
    """See `following`; a line that belongs nowhere would not be run."""
    assert [name for name, has in GROUPS.items() if has(line)] in [[name] for name in GROUPS]


@pytest.mark.parametrize("line", [line for line in INLINE if "COMMAND" not in line])
def test_commands_within_sentences_exist(line: str) -> None:
    app.parse_args(shlex.split(line)[1:], exit_on_error=False, print_error=False)


@pytest.mark.parametrize("page", PAGES, ids=list(TEXT))
def test_pages_name_what_exists(page: Path) -> None:
    for link in re.findall(r"\]\(([^)#]+)(?:#[\w-]+)?\)", page.read_text()):
        if not link.startswith("http"):
            assert (page.parent / link).resolve().exists(), link
    for picture in (ROOT / "docs" / "images").iterdir():
        assert picture.stat().st_size <= 300_000, picture.name


def test_the_site_builds_and_fetches_nothing(tmp_path: Path) -> None:
    pytest.importorskip("mkdocs", reason="the documentation's tools are not installed: pip install -e '.[docs]'")
    line = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path)]
    done = subprocess.run(line, cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    pages = {page.relative_to(tmp_path).as_posix(): page.read_text() for page in tmp_path.rglob("*.html")}
    for name, text in pages.items():
        loaded = re.findall(r"<(?:script|img|iframe)[^>]*\bsrc=\"?([^\"\s>]+)", text)
        loaded += re.findall(r"<link[^>]*rel=\"?(?:stylesheet|preconnect|icon)\"?[^>]*href=\"?([^\"\s>]+)", text)
        assert [address for address in loaded if re.match(r"(?:https?:)?//", address)] == [], name
        assert "arithmatex" not in text, f"{name}: an equation is left in TeX"
    assert pages["concepts/materiality.html"].count("<math") > 20
    assert 'id="eq-3"' in pages["concepts/materiality.html"]
    shown = ["compare", "ablate", "check", "list", "status", "score", "export", "report", "bench", "view", "fetch"]
    for command in (*shown, "scene check", "figure slice", "figure maps"):
        assert f"matbench {command}" in html.unescape(pages["reference/commands.html"])
    assert "lambda of the count term" in pages["reference/methods.html"], "docstrings are shown"
