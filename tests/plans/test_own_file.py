"""Users' own files with what lies beside them, and the files that methods read."""

import json
import os
import pickle
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import matbench
from matbench import parameters
from matbench.algorithms.command import Command
from matbench.cli import main
from matbench.errors import UserError
from matbench.plans import own_file, plugins
from matbench.plans.plan import methods

SCENE = "synthetic/box[size=48x36]"
MINE = """
import numpy as np
from matbench import Estimate
import helper

class {name}:
    def solve(self, scene, context):
        from helper import more
        return Estimate({{scene.ref: np.full((scene.height, scene.width), helper.VALUE + more(), np.float32)}})
"""
HELPER = "VALUE = {}\n\ndef more():\n    return 0.5\n"

Run = Callable[..., tuple[int, str]]


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    """Run a command; its status and what it said."""

    def ran(*words: object) -> tuple[int, str]:
        with pytest.raises(SystemExit) as ended:
            main([str(word) for word in words])
        said = capsys.readouterr()
        return int(ended.value.code or 0), said.out + said.err

    return ran


def put(folder: Path, name: str, value: float, scale: str = "") -> Path:
    """A plug-in with its helper."""
    folder.mkdir(exist_ok=True)
    (folder / "helper.py").write_text(HELPER.format(value) + scale)
    path = folder / f"{name.lower()}.py"
    path.write_text(MINE.format(name=name))
    return path


def answer(path: Path, name: str) -> float:
    """The one disparity that a method gives."""
    scene = matbench.load_scene(SCENE)
    method = plugins.algorithm(name, [path]).load()()
    (value,) = np.unique(method.solve(scene, matbench.Context()).disparity[scene.ref])
    return float(value)


def test_each_folder_has_its_own_helper_and_a_changed_one_is_imported_anew(tmp_path: Path) -> None:
    one, two = put(tmp_path / "one", "One", 1), put(tmp_path / "two", "Two", 2)
    both = plugins.algorithms([one, two])
    first, before = both["one"].load(), plugins.code_digest(both["one"])
    assert [answer(one, "one"), answer(two, "two"), answer(one, "one")] == [1.5, 2.5, 1.5]
    (one.parent / "helper.py").write_text(HELPER.format(7))  # of the same length, within the same second
    assert answer(one, "one") == 7.5
    assert plugins.code_digest(plugins.algorithm("one", [one])) != before
    scene = matbench.load_scene(SCENE)
    late = first().solve(scene, matbench.Context()).disparity[scene.ref]
    assert late[0, 0] == 1.5, "whoever has the old one keeps its helper"
    (one.parent / "helper.py").write_text(HELPER.format(7) + "# why seven\n")
    assert plugins.algorithm("one", [one]).load() is plugins.algorithm("one", [one]).load()
    assert "helper" not in sys.modules
    assert str(one.parent) not in sys.path


def test_what_lies_beside_shadows_for_the_plug_in_alone(tmp_path: Path) -> None:
    mine = put(tmp_path / "one", "One", 1)
    for name in ("json", "numpy", "cv2", "matbench"):
        (mine.parent / name).mkdir()  # folders are no packages here
    (mine.parent / "statistics.py").write_text("MINE = 3\n")
    (mine.parent / "attrs.py").write_text("from attrs import frozen\n")  # its own name in it is that of another
    text = MINE.format(name="One").replace("import helper", "import helper, json, statistics, attrs, cv2\nattrs.frozen")
    mine.write_text(text.replace("helper.VALUE", "statistics.MINE"))
    assert answer(mine, "one") == 3.5
    import statistics

    assert statistics.mean([1, 3]) == 2


def test_a_helper_that_fails_is_told_in_one_line(tmp_path: Path) -> None:
    mine = put(tmp_path / "one", "One", 1)
    (mine.parent / "helper.py").write_text("raise SystemExit('enough')\n")
    before = set(sys.modules)
    with pytest.raises(UserError, match=r"one\.py': SystemExit: enough"):
        plugins.from_file(mine)
    assert set(sys.modules) == before
    (mine.parent / "helper.py").write_text("VALUE = (\n")
    with pytest.raises(UserError, match="SyntaxError"):
        plugins.from_file(mine)


def test_kernels_follow_the_kernels_that_they_call(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from numba import config

    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path / "kernels"))
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kernels"))  # numba reads it again where it has changed
    text = MINE.format(name="One").replace("helper.VALUE + more()", "outer(1.0)")
    outer = "from numba import njit\n\n@njit(cache=True)\ndef outer(x):\n    return inner(x)\n\nclass"
    mine = put(tmp_path / "one", "One", 1)
    mine.write_text(text.replace("import helper", "from helper import inner").replace("class", outer))
    helper = "from numba import njit\n\n@njit(cache=True)\ndef inner(x):\n    return 2 * x\n\ndef more(): pass\n"
    for factor in (2, 3, 2):
        (mine.parent / "helper.py").write_text(helper.replace("2 *", f"{factor} *"))
        assert answer(mine, "one") == factor
    assert list((tmp_path / "kernels").rglob("*.nbi")), "they were kept"
    assert str(tmp_path / "kernels") == config.CACHE_DIR


def test_a_run_goes_on_after_a_comment_and_not_after_another_helper(tmp_path: Path, run: Run) -> None:
    mine, out = put(tmp_path / "one", "One", 1), tmp_path / "run"
    line = "compare", "-a", "one", "-s", SCENE, "--plugin", mine, "--out", out

    def left() -> list[str]:
        status, said = run(*line, "--dry-run", "--json")
        assert status == 0
        return [one["reason"] for one in json.loads(said)["todo"]]

    status, said = run(*line)
    assert status == 0, said
    done = {path: path.stat().st_mtime_ns for path in out.glob("cells/*/cell.json")}
    helper = mine.parent / "helper.py"
    helper.write_text('"""What helps."""\n\n' + HELPER.format("(\n    1  # one\n)"))
    mine.write_text("# mine\n" + mine.read_text())
    assert left() == []
    assert run(*line)[0] == 0
    assert {path: path.stat().st_mtime_ns for path in out.glob("cells/*/cell.json")} == done
    helper.write_text(HELPER.format(3))
    assert left() == ["code changed"]
    assert run(*line)[0] == 0
    maps = {float(np.load(path)["view_2"].max()) for path in out.glob("cells/*/disparity.npz")}
    assert maps == {1.5, 3.5}, "the old answer stays, the new one is another"
    (tried,) = json.loads(run("check", mine, "--json")[1])
    assert {one["check"]: one["verdict"] for one in tried["checks"]}["answers"] == "pass"
    assert "one" in json.loads(run("list", "--plugin", mine, "--json")[1])["algorithms"]


READS = """
from pathlib import Path
import numpy as np
from matbench import Estimate

class Net:
    reads = (Path(__file__).with_name("table.txt"),)

    def __init__(self, weights: Path = Path(__file__).with_name("weights.txt"), more: Path | None = None) -> None:
        self.weights, self.more = weights, more

    def solve(self, scene, context):
        value = float(self.weights.read_text()) + float(self.reads[0].read_text())
        return Estimate({scene.ref: np.full((scene.height, scene.width), value, np.float32)})
"""


@pytest.fixture
def net(tmp_path: Path) -> Path:
    """A method that reads a declared file, and one that is a parameter."""
    (tmp_path / "net.py").write_text(READS)
    (tmp_path / "weights.txt").write_text("1")
    (tmp_path / "table.txt").write_text("2")
    return tmp_path / "net.py"


def key(net: Path, selector: str = "net") -> str:
    (found,) = methods(selector, [net])
    return found.code


def test_files_that_a_method_reads_count(net: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    codes = [key(net)]
    for name in ("weights.txt", "table.txt"):
        net.with_name(name).write_text("3")
        codes.append(key(net))
    assert len(set(codes)) == 3
    said = json.loads(run("list", "--plugin", net, "--json")[1])["algorithms"]["net"]
    assert said["reads"] == [str(net.with_name("table.txt"))]
    assert said["parameters"]["weights"] == {"type": "a path", "default": str(net.with_name("weights.txt"))}
    assert re.search(r"│ +reads ", run("list", "--plugin", net)[1])
    net.write_text(READS.replace("reads =", "code_files =").replace("self.reads", "self.code_files"))
    before = key(net)
    net.with_name("table.txt").write_text("4")
    assert key(net) != before, "the old name still does"
    net.write_text(READS.replace('reads = (Path(__file__).with_name("table.txt"),)', "reads = 'table.txt'"))
    with pytest.raises(UserError, match="net: reads is no list of paths"):
        key(net)


def test_a_parameter_may_be_a_path(net: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(net.parent)
    other = net.with_name("other.txt")
    shutil.copy(net.with_name("weights.txt"), other)
    (same,) = methods(f"net[weights={net.with_name('weights.txt')}]", [net])
    assert same.changed == "", "it is the default"
    (found,) = methods("net[weights=other.txt]", [net])
    assert (found.params, found.changed) == ({"weights": "other.txt", "more": None}, "weights=other.txt")
    other.write_text("5")
    assert key(net, "net[weights=other.txt]") != found.code
    assert key(net) == same.code
    assert key(net, "net[more=other.txt]") != same.code
    with pytest.raises(UserError, match=r"^net: 'weights=gone.txt' cannot be read: No such file or directory$"):
        key(net, "net[weights=gone.txt]")
    line = "compare", "-a", "net[weights=other.txt]", "-s", SCENE, "--plugin", net, "--out", net.with_name("run")
    assert run(*line)[0] == 0
    (maps,) = net.parent.glob("run/cells/*/disparity.npz")
    assert np.load(maps)["view_2"].max() == 7
    assert json.loads((net.parent / "run" / "plan.json").read_text())


def test_the_program_of_a_command_counts(tmp_path: Path) -> None:
    program = tmp_path / "mine"
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    assert list(Command(str(program)).reads) == [program]
    (before,) = methods(f"command[program={program}]")
    program.write_text("#!/bin/sh\n# in a script of whatever language, everything counts\n")
    (after,) = methods(f"command[program={program}]")
    assert before.code != after.code


def test_paths_are_parameters_as_others_are() -> None:
    class Method:
        def __init__(self, file: Path, without=Path("a")) -> None:  # type: ignore[no-untyped-def]
            self.file, self.without = file, without

    made = parameters.build("method", Method, {"file": "~/b", "without": "c"})
    assert (made.file, made.without) == (Path.home() / "b", Path("c"))
    assert parameters.values_of(made) == {"file": str(Path.home() / "b"), "without": "c"}
    assert parameters.changed(made) == {"file": str(Path.home() / "b"), "without": "c"}
    assert parameters.describe(Path) == "a path"
    assert parameters.paths_of(made) == {"file": made.file, "without": made.without}


@pytest.mark.parametrize("name", ["mine", "json", "my-method", "a.b", "own_file"])
def test_another_process_finds_the_classes_of_a_file_under_their_names(tmp_path: Path, name: str) -> None:
    sent = []
    for folder in ("one", "two"):  # of the same name
        path = put(tmp_path / folder, "Mine", 1).with_name(f"{name}.py")
        (tmp_path / folder / "mine.py").rename(path)
        made = plugins.algorithm("mine", [path]).load()()
        helper = sys.modules[type(made).__module__].__dict__["helper"]
        sent.append(pickle.dumps((made, helper.more)))
    code = "import pickle, sys; print(type(pickle.load(sys.stdin.buffer)[0]).solve.__code__.co_filename)"
    ask = [sys.executable, "-c", code]
    for folder, pickled in zip(("one", "two"), sent, strict=True):
        found = subprocess.run(ask, input=pickled, capture_output=True, check=True)
        assert Path(found.stdout.decode().strip()) == tmp_path / folder / f"{name}.py"
    (tmp_path / "two" / "helper.py").write_text(HELPER.format(8))
    changed = subprocess.run(ask, input=sent[1], capture_output=True, check=False)
    assert b"is not what it was when the process began that asks for it" in changed.stderr.splitlines()[-1]


def test_a_pipe_is_no_plug_in_and_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "mine.py")
    with pytest.raises(UserError, match=r"mine\.py' is no file"):
        own_file.import_file(tmp_path / "mine.py")
