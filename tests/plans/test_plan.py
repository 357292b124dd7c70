"""Methods and scenes of a plan."""

from pathlib import Path

import pytest

from matbench import Context, load_scene
from matbench.errors import UserError
from matbench.plans.plan import make_plan, methods, plugin_of


def test_a_method_in_two_spellings_is_one(tmp_path: Path) -> None:
    selectors = ["materiality[preset=paper]", "materiality[preset=paper passes=50]", "sgbm", "sgbm[fill=true]"]
    assert [str(method) for method in methods(selectors)] == ["materiality[preset=paper]", "sgbm"]


def test_a_growing_run_is_the_same_request_however_far_it_has_come() -> None:
    names = [f"synthetic/box[seed={k} size=48x36]" for k in range(3)]
    scenes = {name: load_scene(name) for name in names}
    first, second, all_at_once = (
        make_plan(methods("sgbm"), {name: scenes[name] for name in names[:count]}, [0], among=among)
        for count, among in ((1, names), (2, names), (3, ()))
    )
    assert first.request == second.request
    assert first.digest == second.digest != all_at_once.digest
    assert first.among == tuple(names)
    assert (len(first.cells), len(second.cells)) == (1, 2)
    assert "grows" not in all_at_once.request


VERSION = """
from helper import SHARE
from matbench import Estimate


class Mine:
    def __init__(self, window: int = 5) -> None:
        self.window = window

    def solve(self, scene, context):
        import numpy as np

        return Estimate({scene.ref: np.full((scene.height, scene.width), SHARE, np.float32)})
"""


@pytest.fixture
def versions(tmp_path: Path) -> tuple[Path, Path]:
    """Two files of one name, with one class of one name; only their helpers differ, which have one name, too."""
    found = []
    for folder, share in (("new", 1), ("old", 2)):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "helper.py").write_text(f"SHARE = {share}\n")
        found.append(tmp_path / folder / "mine.py")
        found[-1].write_text(VERSION)
    return found[0], found[1]


def test_two_files_of_one_name_are_two_methods(versions: tuple[Path, Path]) -> None:
    new, old = versions
    mine, before = methods(["mine[window=3]", f"{old}:Mine[window=3] as before"], [new])
    assert (str(mine), mine.names, mine.file) == ("mine[window=3]", ("mine", "window=3"), "")
    assert (str(before), before.names, before.file) == ("before", ("before", ""), str(old))
    assert mine.algorithm == before.algorithm == "mine"
    assert mine.code != before.code
    scene = load_scene("synthetic/box[size=48x36]")
    answers = [plugin_of(one, [new]).make(one.params).solve(scene, Context()) for one in (mine, before, mine)]
    assert [float(one.disparity[scene.ref][0, 0]) for one in answers] == [1, 2, 1], "their code does not mix"
    plan = make_plan([mine, before], {scene.name: scene}, [0], [new])
    assert [[str(cell.method) for cell in part] for part in plan.questions] == [["mine[window=3]"], ["before"]]
    assert len({cell.key for cell in plan.cells}) == 2


def test_labels_ask_for_nothing(versions: tuple[Path, Path]) -> None:
    """So a run goes on under another label, and its cells stay."""
    scene = load_scene("synthetic/box[size=48x36]")
    plain, named = (make_plan(methods(["sgbm", text]), {"a": scene}, [0]) for text in ("ssd", "ssd as 'a, b'"))
    assert plain.request == named.request
    assert [cell.key for cell in plain.cells] == [cell.key for cell in named.cells]
    assert str(named.cells[1].method) == "a, b"


def test_what_is_swept_stands_in_the_name(versions: tuple[Path, Path]) -> None:
    new = versions[0]
    assert [str(m) for m in methods("mine[window=3,5]", [new])] == ["mine[window=3]", "mine[window=5]"]
    assert [str(m) for m in methods("mine[window=5,5]", [new])] == ["mine[window=5]"]
    assert [str(m) for m in methods(["mine[window=3]", "mine"], [new])] == ["mine[window=3]", "mine"]
    assert [str(m) for m in methods("mine[window=3,5] as 'M'", [new])] == ["M[window=3]", "M[window=5]"]
    assert [str(m) for m in methods("materiality[preset=paper,descent] as M")] == [
        "M[preset=paper]",
        "M[preset=descent]",
    ]
    assert [m.changed for m in methods("mine[window=3,5]", [new])] == ["window=3", ""], "requests are what they were"


@pytest.mark.parametrize(
    ("selectors", "said"),
    [
        (["mine", "{old}:Mine"], "two methods are called mine (mine and {old}): give one a label"),
        (["mine", "{new}:Mine as same"], "mine and same are one method: the same code with the same parameters"),
        (["sgbm as a", "sgbm as b"], "a and b are one method"),
        (["sgbm as x", "ssd as x"], "two methods are called x (sgbm and ssd)"),
        (["{old}:Other"], "unknown method 'Other' of {old}: Possible: mine"),
        (["{old}x.py:Mine"], "does not exist"),
    ],
)
def test_names_that_mean_two_things_are_one_line(versions: tuple[Path, Path], selectors: list[str], said: str) -> None:
    new, old = map(str, versions)
    with pytest.raises(UserError) as caught:
        methods([one.format(new=new, old=old) for one in selectors], [Path(new)])
    assert said.format(new=new, old=old) in str(caught.value)
    assert "\n" not in str(caught.value)
