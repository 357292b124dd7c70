"""What counts as a method's code, and what does not."""

import os
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from attrs import frozen

from matbench import code
from matbench.plans import plugins

Write = Callable[..., Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Write files, given as path below a folder -> content; the folder."""

    def written(folder: str = "", **files: str) -> Path:
        for name, content in files.items():
            path = tmp_path / folder / f"{name.replace('__in', '/__init__').replace('_0_', '/')}.py"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(content)
        return tmp_path / folder

    return written


@pytest.fixture
def forget() -> Iterator[Callable[[], None]]:
    """What a new process would not know; once more at the end."""

    def forgotten() -> None:
        for cached in (code._owners, code._metadata, code._lines, code._is_editable, plugins.installed):
            cached.cache_clear()
        plugins.code_digest.cache_clear()

    forgotten()
    yield forgotten
    forgotten()


def digest(path: Path) -> str:
    return code.of_file(path).digest


MINE = "import numpy as np\nSCALE = 2\ndef solve(x):\n    return x * SCALE\n"


@pytest.mark.parametrize(
    ("other", "is_same"),
    [
        ("# why\nimport numpy as np  # it is quick\n\n\nSCALE = 2\n\n\ndef solve(x):\n    return x * SCALE\n", True),
        ('"""About."""\n' + MINE.replace("    return", '    """Doubled."""\n    return'), True),
        (MINE.replace("x * SCALE", "(\n        x\n        * SCALE\n    )"), True),
        (MINE.replace("SCALE = 2\n", 'SCALE = 2\n"""How much."""\n'), True),
        (MINE.replace("np\n", "np\nfrom typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import pandas\n"), False),
        (MINE.replace("SCALE = 2", "SCALE = 3"), False),
        (MINE.replace("x * SCALE", "x + SCALE"), False),
        (MINE.replace("SCALE = 2", "SCALE = 2.0"), False),
        (MINE.replace("SCALE = 2", "SCALE = '2'"), False),
        (MINE.replace("return x * SCALE", "return SCALE * x"), False),
        (MINE.replace("    return x * SCALE", "    if x:\n        x = 1\n    return x * SCALE"), False),
        (MINE.replace("    return x * SCALE", "    if x:\n        x = 1\n        return x * SCALE"), False),
    ],
)
def test_what_code_does_counts_and_not_how_it_is_written(write: Write, other: str, is_same: bool) -> None:
    mine = write(mine=MINE) / "mine.py"
    before = digest(mine)
    mine.write_text(other)
    assert (digest(mine) == before) is is_same


def test_a_body_ends_where_it_ends(write: Write) -> None:
    inside = write(mine="if a:\n    b = 1\n    c = 1\n") / "mine.py"
    before = digest(inside)
    inside.write_text("if a:\n    b = 1\nc = 1\n")
    assert digest(inside) != before


def test_what_type_checkers_alone_read_does_not_count(write: Write) -> None:
    checked = "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import helper{}\n"
    mine = write(mine=checked.format(""), helper="A = 1\n") / "mine.py"
    before = code.of_file(mine)
    assert ".helper" not in before.parts
    mine.write_text(checked.format(" as other"))
    assert digest(mine) == before.digest
    mine.write_text(checked.format("") + "else:\n    import helper\n")
    assert ".helper" in code.of_file(mine).parts


@pytest.mark.parametrize(
    "imports",
    [
        "import helper",
        "from helper import A",
        "from .helper import A",
        "from . import helper",
        "def solve():\n    import helper as h",
        "try:\n    import helper\nexcept ImportError:\n    pass",
        "from importlib import import_module\nimport_module('.helper', __package__)",
        "import importlib\nimportlib.import_module('helper')",
        "import other",
        "from package import sub",
        "import package.sub",
        "from package.inner.deep import A",
        "from package import *",
        "class Mine:\n    from helper import A",
    ],
)
def test_imports_are_followed(write: Write, imports: str) -> None:
    files = {
        "other": "import helper",
        "package__in": "from .sub import A",
        "package_0_sub": "from helper import A",
        "package_0_inner_0_deep": "from ...helper import A\nfrom .. import sub",
    }
    folder = write(mine=imports + "\n", helper="A = 1\n", **files)
    before = digest(folder / "mine.py")
    (folder / "helper.py").write_text("A = 1  # one\n")
    assert digest(folder / "mine.py") == before
    (folder / "helper.py").write_text("A = 2\n")
    assert digest(folder / "mine.py") != before


def test_what_is_not_imported_does_not_count(write: Write) -> None:
    folder = write(mine="from package import sub\n", package__in="", package_0_sub="", package_0_aside="", aside="")
    before = digest(folder / "mine.py")
    for name in ("aside", "package/aside", "more"):
        (folder / f"{name}.py").write_text("A = 2\n")
    assert digest(folder / "mine.py") == before
    (folder / "package/__init__.py").write_text("A = 2\n")
    assert digest(folder / "mine.py") != before, "it is run before what lies in it"


def test_circles_end(write: Write) -> None:
    folder = write(a="import b\n", b="from a import X\nimport c\n", c="from b import Y\n")
    assert set(code.of_file(folder / "a.py").parts) == {".a", ".b", ".c"}


@pytest.mark.parametrize("broken", [b"def solve(:\n", b"\xff\xfe", b"a = 1\0", b"(" * 500])
def test_what_is_no_python_counts_by_its_bytes(write: Write, broken: bytes) -> None:
    folder = write(mine="try:\n    import helper\nexcept SyntaxError:\n    pass\n")
    (folder / "helper.py").write_bytes(broken)
    before = digest(folder / "mine.py")
    (folder / "helper.py").write_bytes(broken + b"1")
    assert digest(folder / "mine.py") != before


def test_a_module_that_may_not_be_read_is_no_error(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = write(mine="import helper\n", helper="A = 1\n")
    original = Path.read_bytes

    def guarded(path: Path) -> bytes:
        if path.name == "helper.py":
            raise PermissionError(13, "Permission denied")
        return original(path)

    monkeypatch.setattr(Path, "read_bytes", guarded)
    assert code.of_file(folder / "mine.py").parts[".helper"] == "unreadable"


def test_what_is_not_there_counts_as_missing(write: Write) -> None:
    mine = write(mine="try:\n    import no_such_thing\nexcept ImportError:\n    pass\n") / "mine.py"
    assert code.of_file(mine).parts["no_such_thing"] == "none"


# the harness


def test_the_short_names_of_the_harness_do_not_drag_it_all_in(write: Write) -> None:
    few = {"matbench.algorithm", "matbench.errors", "matbench.safe_text", "matbench.scene", "matbench.space"}
    ways = [
        "from matbench import Context, Estimate, Scene\n",
        "import matbench\ndef solve(x):\n    return matbench.Estimate(x)\n",
        "import matbench as mb\nANSWER = mb.Estimate\n",
        "from matbench.algorithm import Estimate\n",
        "import matbench.algorithm\nANSWER = matbench.algorithm.Estimate\n",
    ]
    for way in ways:
        parts = code.of_file(write(mine=way) / "mine.py").parts
        assert {name for name in parts if name.startswith("matbench")} == few, way
    whole = code.of_file(write(mine="from matbench import compare\n") / "mine.py").parts
    assert {"matbench.comparison", *few} < set(whole)


def test_what_built_in_methods_import() -> None:
    known = plugins.installed("algorithms")
    parts = {name: set(plugins.code_of(plugin).parts) for name, plugin in known.items()}
    common = {"matbench.algorithm", "matbench.errors", "matbench.safe_text", "matbench.scene", "matbench.space"}
    common |= {"numpy", "attrs"}
    sgbm = {f"matbench.algorithms.{name}" for name in ("sgbm", "holes", "parameters")}
    assert parts["sgbm"] == {*common, *sgbm, "opencv-python-headless"}
    reading = {"matbench.algorithms.command", "matbench.algorithms.cameras"}
    files = "arrays", "images", "jpeg", "maps", "pfm", "plain", "removal", "temporary", "tiff", "unzip"
    reading |= {f"matbench.files.{name}" for name in files}
    assert parts["command"] == {*parts["sgbm"], *reading}
    assert "matbench.algorithms.materiality.energy" in parts["materiality"]
    assert "numba" in parts["materiality"]
    assert not any("materiality" in name for name in parts["multiview_sgm"])
    assert not any("regions" in name for found in parts.values() for name in found), "scores alone need them"
    assert [name for name, found in parts.items() if "matbench.spec" in found] == ["maps"], "it reads scenes' names"
    assert not any("matbench.plans.kernel_cache" in found for found in parts.values()), "it changes no answer"
    folder = Path(code.__file__).parent / "algorithms"
    kernels = [
        file for file in folder.rglob("*.py") if "njit" in file.read_text() or "kernels import" in file.read_text()
    ]
    reached = {file for plugin in known.values() for file in plugins.code_of(plugin).files.values()}
    assert len(kernels) > 5
    assert set(kernels) <= reached, "a kernel that no method reaches has no folder of its own state"


def test_a_plug_in_that_subclasses_a_built_in_method_follows_it(write: Write) -> None:
    built_in = code.of_module("matbench.algorithms.sgbm", "SGBM")
    mine = write(mine="from matbench.algorithms.sgbm import SGBM\nclass Mine(SGBM):\n    pass\n") / "mine.py"
    assert dict(code.of_file(mine).parts) == {**built_in.parts, ".mine": code.of_file(mine).parts[".mine"]}


def test_all_built_in_methods_are_read_quickly() -> None:
    code.facts.cache_clear()
    begin = time.process_time()
    for plugin in plugins.installed("algorithms").values():
        plugins.code_of(plugin)
    assert time.process_time() - begin < 1, "0.1 s on the machine that this was written on"


# what is installed


@frozen
class Site:
    """A folder as packages are installed in."""

    folder: Path

    def install(self, name: str, version: str, *tops: str, **files: str) -> None:
        """Metadata, and modules as path -> content, ``_0_`` for a slash."""
        for old in self.folder.glob(f"{name}-*.dist-info"):
            (old / "top_level.txt").unlink(missing_ok=True)
            for file in old.iterdir():
                file.unlink()
            old.rmdir()
        info = self.folder / f"{name}-{version}.dist-info"
        info.mkdir(parents=True)
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
        if tops:
            (info / "top_level.txt").write_text("\n".join(tops))
        record = []
        for path, content in files.items():
            file = self.folder / f"{path.replace('__in', '/__init__').replace('_0_', '/')}.py"
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(content)
            record.append(f"{file.relative_to(self.folder).as_posix()},sha256=x,1")
        (info / "RECORD").write_text("\n".join(record))


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, forget: Callable[[], None]) -> Iterator[Site]:
    """A folder of installed packages, of this test only."""
    folder = tmp_path / "site"
    folder.mkdir()
    monkeypatch.syspath_prepend(folder)
    yield Site(folder)
    for name in [name for name in sys.modules if name.partition(".")[0] in ("theirs", "space", "spare")]:
        del sys.modules[name]


@pytest.mark.parametrize("tops", [(), ("theirs",)])
def test_other_peoples_packages_count_by_their_version(
    write: Write, site: Site, forget: Callable[[], None], tops: tuple[str, ...]
) -> None:
    mine = write("plug", mine="from theirs.deep import A\n") / "mine.py"
    site.install("their_tools", "1.0", *tops, theirs__in="", theirs_0_deep="A = 1\n")
    before = code.of_file(mine)
    assert dict(before.parts) == {".mine": before.parts[".mine"], "their-tools": "1.0"}
    (site.folder / "theirs/deep.py").write_text("A = 2\n")
    forget()
    assert digest(mine) == before.digest, "whoever changes installed files does not tell"
    site.install("their_tools", "1.1", *tops, theirs__in="", theirs_0_deep="A = 1\n")
    forget()
    assert digest(mine) != before.digest


def test_an_editable_package_counts_by_its_files(
    write: Write, site: Site, forget: Callable[[], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    mine = write("plug", mine="from theirs.deep import A\n") / "mine.py"
    source = write("source", theirs__in="", theirs_0_deep="from .more import A\n", theirs_0_more="A = 1\n")
    site.install("theirs", "1.0", "theirs")  # its metadata are here, its code there
    monkeypatch.syspath_prepend(source)
    before = code.of_file(mine)
    assert set(before.parts) == {".mine", "theirs", "theirs.deep", "theirs.more"}
    (source / "theirs/more.py").write_text("A = 2\n")
    assert digest(mine) != before.digest


def test_a_method_in_a_namespace_package_has_a_digest(site: Site) -> None:
    site.install("mine", "1.0", "space", space_0_mine_0_methods="from space.mine.help import A\n")
    (site.folder / "space/mine/help.py").write_text("A = 1\n")
    before = code.of_module("space.mine.methods", "Mine")
    assert set(before.parts) == {"space.mine.methods", "space.mine.help"}, "its own project is followed"
    (site.folder / "space/mine/help.py").write_text("A = 2\n")
    assert code.of_module("space.mine.methods", "Mine").digest != before.digest


def test_names_that_a_package_imports_when_they_are_used(site: Site) -> None:
    lazy = "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from .one import One\n    from .two import Two\n"
    site.install("mine", "1.0", "spare", spare__in=lazy, spare_0_one="A = 1\n", spare_0_two="A = 1\n")
    assert set(code.of_module("spare", "One").parts) == {"spare", "spare.one"}


def test_the_standard_library_does_not_count(write: Write) -> None:
    mine = write(mine="import json, os.path, xml.etree.ElementTree\nfrom collections import abc\n") / "mine.py"
    assert set(code.of_file(mine).parts) == {".mine"}


def test_a_helper_of_any_size_counts_and_is_not_read_as_a_whole(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = write(mine="import table\n", table="import other\nNUMBERS = [1, 2]\n", other="")
    usual = code.of_file(folder / "mine.py")
    assert ".other" in usual.parts
    monkeypatch.setattr(code, "_LARGEST_SOURCE", 20)
    large = code.of_file(folder / "mine.py")
    assert ".other" not in large.parts, "its imports are not looked for"
    (folder / "table.py").write_text("import other\nNUMBERS = [1, 3]\n")
    changed = code.of_file(folder / "mine.py")
    assert changed.parts[".table"] != large.parts[".table"], "but its bytes count"


def test_a_file_that_is_larger_than_any_module_is_not_read_at_all(write: Write) -> None:
    folder = write(mine="import table\n", table="")
    os.truncate(folder / "table.py", 1 << 40)
    assert code.of_file(folder / "mine.py").parts[".table"] == "unreadable"
    with pytest.raises(OSError, match="File too large"):
        code.of_file(folder / "table.py")
