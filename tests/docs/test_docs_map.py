"""The map of the code in the documentation: every package and module is in it, with what it says of itself."""

import runpy
from pathlib import Path

import pytest
from shown import ROOT, TEXT

CODE_MAP = runpy.run_path(str(ROOT / "docs" / "code_map.py"))
FOLDERS = ("matbench", "algorithms", "datasets", "reports")
FILES = [path for name in FOLDERS for path in sorted((ROOT / name).rglob("*.py")) if path.name != "_version.py"]
# links are the same files again
FILES = [path for path in FILES if path.resolve() == path and "__pycache__" not in path.parts]


def test_every_package_and_module_is_in_the_map() -> None:
    text = "\n".join(CODE_MAP["lines"]())
    assert len(FILES) > 130
    for path in FILES:
        folder = path.parent.relative_to(ROOT).as_posix()
        section = text.partition(f"### `{folder}/`\n")[2].partition("\n###")[0]
        assert section, f"{folder} is not in the map"
        if path.name != "__init__.py":
            assert section.count(f"\n| `{path.stem}` | ") == 1, path
    assert text.count("\n| `") == sum(path.name != "__init__.py" for path in FILES), "nothing stands in it twice"


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_each_says_what_it_is_for(path: Path) -> None:
    said = CODE_MAP["_said"](path)
    assert said.endswith((".", "?", ".``", "?``")), f"{path}: {said!r} is no sentence"
    if (
        path.name == "__init__.py"
        and path.parent.parent in (ROOT, ROOT / "matbench")
        and path.parent.name != "matbench"
    ):
        assert "Imports" in said, f"{path}: what may it import?"


def test_the_page_is_given_the_map() -> None:
    page = TEXT["docs/reference/harness.md"]
    made = CODE_MAP["on_page_markdown"](page)
    assert CODE_MAP["PLACE"] in page
    assert CODE_MAP["PLACE"] not in made
    assert "| `keeper` | Keepers, as the run sees them: " in made
    assert CODE_MAP["on_page_markdown"]("another page") == "another page"
