"""What the README and the documentation name exists, nothing that they show is left out, and the site builds."""

import html
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from following import GROUPS, lines
from shown import LINES, PAGES, ROOT, TEXT


def test_every_command_is_run_in_one_way() -> None:
    groups = {line: [name for name, has in GROUPS.items() if has(line)] for line in LINES}
    assert {line: found for line, found in groups.items() if len(found) != 1} == {}


@pytest.mark.parametrize("line", lines("install"), ids=str)
def test_installing_is_what_ci_begins_with(line: str) -> None:
    """Where other extras are named than there, they exist."""
    ci = (ROOT / ".ci" / "run").read_text().replace('"$place/venv', ".venv").replace('"', "")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    for part in line.split(" && "):
        if hit := re.fullmatch(r"pip install (?:-e )?'?(\.|[\w-]+)(?:\[([\w,]+)\])?'?", part):
            assert hit[1] in (".", project["name"])
            assert {*(hit[2] or "test").split(",")} <= project["optional-dependencies"].keys()
        else:
            assert part in ci


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
