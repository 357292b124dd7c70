"""Naming scenes: patterns, sizes, groups, and the folder they are looked for in."""

import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from matbench import comparison
from matbench.errors import UserError
from matbench.files.own_folders import data_folder
from matbench.plans import plugins
from matbench.plans.settings import Settings
from matbench.scenes.catalogue import DATA_VARIABLE, data_root, is_pattern, listings, load_scene, select, sets
from matbench.scenes.dataset import Listing


def write(folder: Path, *names: str) -> None:
    folder.mkdir(parents=True)
    for name in names:
        assert cv2.imwrite(str(folder / name), np.full((20, 40), 100, np.uint8))


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """Aloe in two sizes, Baby1 in one, Computer without truth, an incomplete Rocks1."""
    base, views = tmp_path / "middlebury", [f"view{k}.png" for k in range(7)]
    truths = ["disp1.png", "disp5.png"]
    write(base / "scenes2006/ThirdSize/Aloe", *views, *truths)
    write(base / "scenes2006/HalfSize/Aloe", *views, *truths)
    write(base / "scenes2006/ThirdSize/Baby1", *views, *truths)
    write(base / "scenes2006/ThirdSize/Rocks1", *views[:5], *truths)
    write(base / "scenes2005/FullSize/Computer", *views)
    write(base / "scenes2005/HalfSize/Art", *views, *truths)
    return tmp_path


def test_a_pattern_takes_the_scenes_that_are_present(root: Path) -> None:
    assert select("middlebury2006/*", root).names == ("middlebury2006/Aloe", "middlebury2006/Baby1")
    assert select("middlebury2006/*", root).left_out == {}


def test_a_pattern_with_a_size_takes_those_that_have_it_and_says_so(root: Path) -> None:
    half = select("middlebury2006/*[size=half]", root)
    assert half.names == ("middlebury2006/Aloe[size=half]",)
    assert half.left_out == {"not there in size half": ["middlebury2006/Baby1"]}
    for name in half.names:
        assert load_scene(name, root).name == name
    both = select("middlebury200?/A*[size=third,half]", root)
    assert both.names == (
        "middlebury2006/Aloe[size=third]",
        "middlebury2005/Art[size=half]",
        "middlebury2006/Aloe[size=half]",
    )
    assert both.left_out == {"no size third": ["middlebury2005/Art"]}


def test_a_pattern_leaves_out_what_cannot_be_scored_and_says_so(root: Path) -> None:
    found = select("middlebury2005/*", root)
    assert found.names == ("middlebury2005/Art",)
    assert found.left_out == {"no ground truth": ["middlebury2005/Computer"]}
    with pytest.raises(UserError, match=r"none can be compared \(middlebury2005/Computer: no ground truth\): see"):
        select("middlebury2005/C*", root)
    assert select("middlebury2005/C*", root, needs_truth=False).names == ("middlebury2005/Computer",)


def test_a_prediction_needs_no_truth(root: Path) -> None:
    found = select("middlebury2005/*[predict=right]", root)
    assert found.names == ("middlebury2005/Art[predict=right]", "middlebury2005/Computer[predict=right]")
    assert found.left_out == {}
    scene = load_scene("middlebury2005/Computer[predict=right]", root)
    assert (scene.truth, scene.labels[-1]) == ({}, "5")
    assert scene.held_out is not None
    assert scene.held_out.label == "6"


def test_what_a_scene_has_not_is_left_out_of_patterns_only(root: Path, tmp_path: Path) -> None:
    """From two views none can be withheld; nine there are not."""
    asked = ["middlebury2006/A*[views=2,3,9 predict=right]", "middlebury2006/Baby1[views=3]"]
    ready = comparison.prepare("sgbm", asked, settings=Settings(root), out=tmp_path / "run")
    assert set(ready.scenes) == {"middlebury2006/Aloe[predict=right views=3]", "middlebury2006/Baby1[views=3]"}
    names = [f"middlebury2006/Aloe[views={n} predict=right]" for n in (2, 9)]
    assert ready.left_out == {"the scenes have not these views": names}
    with pytest.raises(UserError, match="at least three"):
        comparison.prepare(
            "sgbm", asked[1].replace("views=3", "views=2 predict=right"), settings=Settings(root), out=tmp_path / "no"
        )


def test_sizes_that_a_dataset_reads_itself_are_left_to_it() -> None:
    assert "synthetic/box[size=96x72]" in select("synthetic/*[size=96x72]").names


def test_a_group_is_a_pattern_with_a_name(root: Path) -> None:
    with pytest.raises(UserError, match="3 scenes that 'paper' matches are known but not under the data folder"):
        select("paper", root)
    folder = root / "middlebury/scenes2006/ThirdSize/Rocks1"
    for k in (5, 6):
        assert cv2.imwrite(str(folder / f"view{k}.png"), np.zeros((20, 40), np.uint8))
    assert select("paper", root).names == ("middlebury2006/Rocks1",)


def test_what_is_not_there_names_the_command_that_brings_it(root: Path) -> None:
    with pytest.raises(UserError, match=r"matbench fetch 'middlebury2001/\*'"):
        select("middlebury2001/*", root)
    with pytest.raises(UserError, match="matbench fetch middlebury2001/venus brings it"):
        load_scene("middlebury2001/venus", root)


def test_without_a_name_the_persons_own_folder_is_the_data_root(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, root: Path
) -> None:
    monkeypatch.delenv(DATA_VARIABLE, raising=False)
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "own"))
    assert data_root() is None, "it is not there yet"
    data_folder().mkdir(parents=True)
    assert data_root() == data_folder().resolve()
    assert data_root(root) == root.resolve()
    monkeypatch.setenv(DATA_VARIABLE, str(root))
    assert data_root() == root.resolve()


def test_compare_says_which_scenes_of_a_pattern_it_goes_without(root: Path) -> None:
    line = [sys.executable, "-m", "matbench", "compare", "-a", "sgbm", "-s", "middlebury2006/*[size=half]"]
    done = subprocess.run([*line, "--data", str(root)], cwd=root, capture_output=True, text=True, timeout=120)
    assert "without middlebury2006/Baby1: not there in size half" in done.stdout, done.stderr
    assert done.returncode == 0, done.stdout


def test_a_set_stands_for_its_scenes_in_order() -> None:
    """With its options put over theirs; no pattern matches what has no end."""
    quick = select("worlds/quick").names
    assert len(quick) == 12
    assert quick[:2] == ("synthetic/world-0[size=160x120]", "synthetic/world-1[size=160x120]")
    assert select("worlds/quick[noise=4 size=80x60]").names[1] == "synthetic/world-1[size=80x60 noise=4]"
    assert select(["synthetic/box", "worlds/quick"]).names == ("synthetic/box", *quick)
    assert (is_pattern("worlds/quick"), is_pattern("worlds/none"), is_pattern("synthetic/box")) == (True, False, False)
    assert not any("world" in name for name in select("synthetic/*").names)
    listing = listings()["synthetic/world"]
    assert isinstance(listing, Listing)
    assert listing.endless
    with pytest.raises(UserError, match="worlds/quick is a set of 12 scenes: name one of them"):
        load_scene("worlds/quick")
    with pytest.raises(UserError, match="dataset 'worlds'"):
        load_scene("worlds/none")


def test_a_set_of_ones_own(tmp_path: Path) -> None:
    """A dataset declares sets; one that fails harms no other, and none takes the name of another."""
    (tmp_path / "mine.py").write_text(
        "class Rooms:\n"
        "    def listings(self, root): return []\n"
        "    def load(self, name, options, root): raise NotImplementedError\n"
        "    def sets(self): return {'mine/small': ['rooms/a', 'rooms/b[x=1]'], 'paper': []}\n"
        "class Odd(Rooms):\n"
        "    def sets(self): raise ValueError('no')\n"
    )
    with plugins.using([tmp_path / "mine.py"]):
        assert select("mine/small[y=2]").names == ("rooms/a[y=2]", "rooms/b[x=1 y=2]")
        assert len(sets()["paper"]) == 3
        assert len(sets()["worlds/quick"]) == 12
