"""A step of the site's build: the map of the code, made from what packages and modules say of themselves."""

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
PLACE = "<!-- the map of the code -->"
PACKAGES = ("matbench", "algorithms", "datasets", "reports")
"""Folders of the checkout; the last three are linked into the first, and shown by themselves."""


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Put the map where a page has its place."""
    return markdown.replace(PLACE, "\n".join(lines())) if PLACE in markdown else markdown


def lines() -> Iterator[str]:
    """A heading and a sentence for each package, a line for each of its modules."""
    for package in packages():
        yield f"\n### `{package.relative_to(ROOT).as_posix()}/`\n\n{_said(package / '__init__.py')}\n"
        modules = [path for path in sorted(package.glob("*.py")) if path.name not in ("__init__.py", "_version.py")]
        if modules:
            yield "| module | what it is for |\n|---|---|"
        for module in modules:
            yield f"| `{module.stem}` | {_said(module)} |"


def packages() -> list[Path]:
    """All folders that hold modules, each before those within it."""
    inits = [init for name in PACKAGES for init in _inits(ROOT / name)]
    return [init.parent for init in inits]


def _inits(folder: Path) -> list[Path]:
    below = [one for one in sorted(folder.iterdir()) if one.is_dir() and not one.is_symlink()]
    own = [folder / "__init__.py"] if (folder / "__init__.py").is_file() else []
    return own + [init for one in below for init in _inits(one)]


def _said(path: Path) -> str:
    """The first paragraph of a module's docstring and what it imports, if it says so, as a cell of a table."""
    first, *rest = (ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or "").split("\n\n")
    said = " ".join([first, *(part for part in rest if part.startswith("Imports "))])
    return " ".join(said.split()).replace("|", "\\|")
