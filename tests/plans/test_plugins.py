"""What users' own files offer besides methods: scenes and metrics, found as long as somebody uses the file."""

import threading
from pathlib import Path

import numpy as np
import pytest
from shown import OWN_FILES

import matbench
from matbench.errors import UserError
from matbench.measures.metrics import METRICS, Metric
from matbench.plans import plugins
from matbench.results import metric_catalogue
from matbench.scenes.catalogue import listings, load_scene

SCENE = """
import numpy as np
from matbench import Listing, Range, Scene

class {cls}:
    {body}
    def listings(self, root):
        return [Listing("a", 2, {{"4x4": (4, 4)}}, True)]

    def load(self, name, options, root):
        views = np.zeros((2, 4, 4, 3), np.uint8)
        return Scene({name!r}, views, ("0", "1"), 0, Range(0, 1), {{0: np.ones((4, 4), np.float32)}}, 1)
"""


def written(folder: Path, text: str, name: str = "own.py") -> Path:
    (folder / name).write_text(text)
    return folder / name


def scene_file(folder: Path, cls: str = "Desk", name: str = "desk/a", body: str = "pass") -> Path:
    return written(folder, SCENE.format(cls=cls, name=name, body=body))


def metric_file(folder: Path, line: str) -> Path:
    return written(folder, f"from matbench import Metric, MapInRegion\n{line}\n")


def test_a_file_offers_what_is_in_it_and_nothing_else(tmp_path: Path) -> None:
    walls, judge, mine = (written(tmp_path, OWN_FILES[name], name) for name in ("walls.py", "judge.py", "mine.py"))
    assert list(plugins.from_file(walls, "datasets")) == ["walls"]
    assert list(plugins.from_file(mine)) == ["mine"]
    for file, group in [(walls, "algorithms"), (judge, "algorithms"), (judge, "datasets"), (mine, "datasets")]:
        assert not plugins.from_file(file, group)
    assert [metric.name for metric in plugins.own_metrics(judge)] == ["fine", "too_near", "roughness"]
    assert plugins.own_metrics(walls) == plugins.own_metrics(mine) == ()


def test_scenes_and_metrics_are_known_within_the_block_only(tmp_path: Path) -> None:
    files = [written(tmp_path, OWN_FILES[name], name) for name in ("walls.py", "judge.py")]
    before = metric_catalogue.metrics()
    with plugins.using(files):
        assert {"walls/near", "walls/far"} <= set(listings())
        assert [m.name for m in metric_catalogue.metrics()[len(before) :]] == ["fine", "too_near", "roughness"]
        seen: list[bool] = []
        other = threading.Thread(target=lambda: seen.append("walls" in plugins.datasets()))
        other.start()
        other.join()
        assert seen == [False], "what one thread uses is no other's"
        with plugins.using(files[1:]):
            assert "walls" not in plugins.datasets()
        assert load_scene("walls/near").name == "walls/near"
    assert metric_catalogue.metrics() == before
    with pytest.raises(UserError, match="unknown dataset 'walls'"):
        load_scene("walls/near")


def test_regions_follow_from_the_truth(tmp_path: Path) -> None:
    scene = matbench.load_scene("walls/near", plugin=written(tmp_path, OWN_FILES["walls.py"], "walls.py"))
    assert scene.regions["all"].all()
    assert not scene.regions["nonocc"][:, :6].any(), "beyond the frame of the right view"
    assert scene.regions["nonocc"][:, 6:].all()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("x = 1", "holds no method (a class with solve"),
        (SCENE.format(cls="Synthetic", name="x", body="pass"), "the name 'synthetic' is taken by matbench-stereo"),
        (SCENE.format(cls="A", name="x", body="name = 'a b'"), "dataset name 'a b' may hold"),
        ("raise SystemExit(3)", "SystemExit: 3"),
    ],
)
def test_what_is_wrong_with_a_file_is_one_line(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(UserError) as told, plugins.using([written(tmp_path, text)]):
        pass
    assert said in str(told.value)
    assert "\n" not in str(told.value)
    assert plugins.used() == ()


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("M = Metric('avg', 'px', 'lower', 'mine', max)", "the name of metric 'avg' is taken"),
        ("A, B = (Metric('m', 'px', 'lower', about, max) for about in 'ab')", "the name of metric 'm' is taken"),
        ("class M:\n    better, compute = 'lower', max\nM = M()", "M is no metric: make it of matbench.Metric"),
        ("M = Metric('m', 'px', 'lower', '', max, takes='all')", "takes"),
    ],
)
def test_a_metric_that_is_none_is_refused(tmp_path: Path, line: str, said: str) -> None:
    with pytest.raises(UserError, match=r"own\.py") as told, plugins.using([metric_file(tmp_path, line)]):
        metric_catalogue.metrics()
    assert said in str(told.value)


def test_metrics_that_are_known_already_are_not_taken_twice(tmp_path: Path) -> None:
    file = metric_file(tmp_path, "from matbench.measures.metrics import METRICS\nM = Metric('m', '', 'lower', '', max)")
    with plugins.using([file]):
        names = [metric.name for metric in metric_catalogue.metrics()]
    assert len(names) == len(set(names))
    assert names[-1] == "m"


def test_a_dataset_that_cannot_be_made_harms_no_other(tmp_path: Path) -> None:
    file = scene_file(tmp_path, body="def __init__(self, year): pass\n")
    with plugins.using([file]):
        known = listings()
        assert isinstance(known["desk"], UserError)
        assert "synthetic/box" in known
        with pytest.raises(UserError, match=r"dataset .desk. from .*own\.py: .*year"):
            load_scene("desk/a")


def test_a_scene_must_be_called_as_it_is_loaded(tmp_path: Path) -> None:
    with plugins.using([scene_file(tmp_path, name="a")]), pytest.raises(UserError, match="must be called desk/a"):
        load_scene("desk/a")


def test_old_metrics_are_given_absolute_errors(tmp_path: Path) -> None:
    assert {metric.takes for metric in METRICS if metric.name != "bias"} == {"absolute"}
    old = Metric("old", "px", "lower", "as before", lambda errors: float(np.nanmax(errors)))
    assert old.takes == "absolute"
    assert old.picture is None


def test_some_built_in_methods_run_only_when_they_are_named() -> None:
    """A newcomer's first run takes less than a minute; slow methods and plain ones are asked for."""
    default, every = plugins.default_algorithms(), plugins.built_in_algorithms()
    assert {"materiality", "multiview_sgm", "kang_szeliski", "guided_filter", "sgbm"} <= set(default) < set(every)
    assert {"graph_cut", "kolmogorov_zabih", "niquin"} <= set(every) - set(default)
    assert "command" not in every
    assert "maps" not in every


@pytest.mark.parametrize("name", ["mine.py", "old/mine.py:"])
def test_a_file_without_its_class_is_told_how_it_is_written(name: str) -> None:
    with pytest.raises(UserError, match=f"unknown algorithm '{name}': write FILE.py:Class"):
        plugins.algorithm(name)
