"""Which scenes a comparison has: each once, and none that cannot be scored."""

from pathlib import Path

import pytest
from attrs import evolve

from matbench.errors import UserError
from matbench.scenes import catalogue, chosen
from matbench.scenes.catalogue import default_scenes, select
from matbench.scenes.chosen import choose

TINY = "synthetic/box[size=48x36]"


def test_one_scene_in_several_spellings_counts_once() -> None:
    names = [TINY, "synthetic/box[seed=0 size=48x36]", "synthetic/box[size=48x36 views=0:5]"]
    found = choose(names, None)
    assert list(found.scenes) == names[:1]
    assert found.spellings == dict.fromkeys(map(str, found.spellings), TINY)
    assert found.left_out == {}


def test_two_scenes_of_one_name_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """A data set that calls two scenes the same: stood in for, as none that is built in does."""
    original = chosen.load_scene
    monkeypatch.setattr(chosen, "load_scene", lambda name, data: evolve(original(name, data), name="x/same"))
    with pytest.raises(UserError, match="two different scenes are called x/same"):
        choose([TINY, "synthetic/weak[size=48x36]"], None)


def test_a_scene_without_truth_or_without_a_row_is_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"row 36 of synthetic/box\[size=48x36\]: 0 to 35 is possible"):
        choose(TINY, None, rows=[0, 36])
    original = chosen.load_scene
    monkeypatch.setattr(chosen, "load_scene", lambda name, data: evolve(original(name, data), truth={}))
    with pytest.raises(UserError, match="has no ground truth of its reference view 2: it needs"):
        choose(TINY, tmp_path)


def test_what_a_pattern_matches_may_lack_views_and_what_is_named_may_not() -> None:
    with pytest.raises(UserError, match="it has 5 views, 2 to 5 is possible"):
        choose("synthetic/box[views=9]", None)
    with pytest.raises(UserError, match="no scene has the views asked for"):
        choose("synthetic/bo?[views=9]", None)
    found = choose([TINY, "synthetic/bo?[views=9]"], None)
    assert list(found.scenes) == [TINY]
    assert list(found.left_out) == ["the scenes have not these views"]


def test_no_scene_is_nothing_to_compare() -> None:
    with pytest.raises(UserError, match="name at least one algorithm and one scene"):
        choose([], None)


def test_without_selectors_the_default_scenes_are_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    computed, missing = default_scenes(tmp_path)
    assert computed == list(select("worlds/quick[size=120x90]").names)
    assert missing == ["middlebury2001/tsukuba", "middlebury2006/Rocks1", "middlebury2003/teddy"]
    monkeypatch.setattr(catalogue, "DEFAULT_SET", TINY)
    assert list(choose(None, tmp_path).scenes) == [TINY]


def test_what_is_known_is_not_read_again() -> None:
    known = choose(TINY, None).scenes
    again = choose([TINY, "synthetic/box[size=64x48]"], None, known=known).scenes
    assert again[TINY] is known[TINY]
    assert len(again) == 2
