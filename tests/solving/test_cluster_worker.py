"""What a worker of a cluster believes and declines, without a cluster."""

from pathlib import Path

import pytest
from attrs import evolve
from compared import SMALL
from places import METHODS

from matbench import comparison
from matbench.plans.settings import Settings
from matbench.solving import cluster, cluster_worker
from matbench.solving.cluster_worker import Reply, Task


def test_a_reply_comes_back_as_it_went() -> None:
    for sent in (Reply("tcp://host:1", b"parcel\nof lines"), Reply("tcp://host:1", declined="it has not ./mine")):
        assert Reply.unpacked(sent.packed()) == sent


@pytest.mark.parametrize(
    "sent", [None, ["tcp://host:1", ""], b"", b"[1, 2]\n", b'["one"]\nparcel', b'["' + b"a" * (1 << 16) + b'", ""]\n']
)
def test_what_is_no_reply_is_said(sent: object) -> None:
    with pytest.raises(ValueError, match=r"a worker|Expecting value"):
        Reply.unpacked(sent)


def test_a_users_file_is_written_with_what_it_imports_and_nowhere_else(tmp_path: Path) -> None:
    sent = (
        ("mine.py", {"mine.py": b"import tools.level", "tools/level.py": b"LEVEL = 2"}),
        ("mine.py", {"mine.py": b""}),
    )
    one, two = map(Path, cluster_worker._write_files(sent, tmp_path))
    assert one != two, "names may be equal"
    assert (one.parent / "tools" / "level.py").read_bytes() == b"LEVEL = 2"
    with pytest.raises(ValueError, match="is no path below a folder"):
        cluster_worker._write_files([("mine.py", {"../../away.py": b""})], tmp_path / "files")
    assert not (tmp_path / "away.py").exists()


def test_what_it_lacks_or_has_otherwise_is_declined(tmp_path: Path) -> None:
    plan = comparison.prepare(["flat"], SMALL, out=tmp_path / "run", plugin=[METHODS], write=False).plan
    (cell,) = plan.cells

    def why(**changes: object) -> str:
        return cluster_worker._why_declined(evolve(cell, **changes), plan.plugin_files, None)

    assert why() == ""
    assert why(method=evolve(cell.method, algorithm="unknown", code="0" * 64)).startswith(
        "the worker cannot use unknown: "
    )
    assert cluster_worker._why_declined(cell, (), None) == (
        "the worker has no method flat: install what offers it there"
    )
    assert "the worker has other code of flat" in why(method=evolve(cell.method, code="0" * 64))
    assert why(scene_digest="0" * 16) == f"the worker's {SMALL} is another one: give all workers the same data"
    assert why(scene="./nowhere").startswith("the worker has not ./nowhere: ")


def test_a_method_that_was_named_with_its_file_is_the_one_in_that_file(tmp_path: Path) -> None:
    """Beside another of the same name; the file lies elsewhere on the worker."""
    old = tmp_path / "old" / "mine.py"
    old.parent.mkdir()
    old.write_text("from helper import Flat as _Flat\n\n\nclass Flat(_Flat):\n    pass\n")
    (old.parent / "helper.py").write_text("class Flat:\n    def solve(self, scene, context):\n        pass\n")
    asked = ["flat", f"{old}:Flat as before"]
    plan = comparison.prepare(asked, SMALL, out=tmp_path / "run", plugin=[METHODS], write=False).plan
    given = tuple((METHODS.name, cluster._with_helpers(METHODS)) for _ in plan.plugin_files)
    for number, cell in enumerate(plan.cells):
        place = tmp_path / str(number)
        task = Task("run", cell, (*given, *cluster._own_file(cell)), Settings())
        files, found = cluster_worker._with_files(task, place)
        assert len(files) == 1
        assert cluster_worker._why_declined(found, files, None) == ""
        assert (found.key, found.method.names) == (cell.key, cell.method.names)
    assert found.method.file == str(place / "1" / "mine.py")
    changed = "mine.py", {"mine.py": old.read_bytes(), "helper.py": b"class Flat:\n    solve = print\n"}
    files, found = cluster_worker._with_files(evolve(task, files=(*given, changed)), tmp_path / "changed")
    assert "other code of flat" in cluster_worker._why_declined(found, files, None)
