"""A shelf holds what there is room for, and loads the rest again, unchanged."""

import numpy as np
import pytest

from matbench.errors import UserError
from matbench.scene import Range, Scene
from matbench.shelf import Facts, Shelf, bytes_of, facts_of, held, only


def made(name: str, grey: int = 0) -> Scene:
    views = np.full((2, 4, 5, 3), grey, np.uint8)
    return Scene(name, views, ("a", "b"), 0, Range(0, 2), {0: np.ones((4, 5), np.float32)}, 1, metrics="hci")


ROOM = 2 * bytes_of(made("a"))


class Loading:
    """Loads scenes, and tells which."""

    def __init__(self) -> None:
        self.names: list[str] = []

    def __call__(self, name: str) -> Scene:
        self.names.append(name)
        return made(name)


@pytest.fixture
def loading() -> Loading:
    return Loading()


@pytest.fixture
def shelf(loading: Loading) -> Shelf:
    found = Shelf(loading, ROOM)
    for name in ("a", "b", "c"):
        found.put(made(name), f"remark on {name}")
    return found


def test_what_was_asked_for_least_recently_goes_and_comes_back(shelf: Shelf, loading: Loading) -> None:
    assert (list(shelf), len(shelf), "a" in shelf, "z" in shelf) == (["a", "b", "c"], 3, True, False)
    assert [held(shelf, name) is not None for name in shelf] == [False, True, True]
    assert shelf["b"].name == "b"
    assert loading.names == []
    assert shelf["a"].digest == made("a").digest
    assert loading.names == ["a"]
    assert [shelf.held(name) is not None for name in shelf] == [True, True, False], "c was the last asked for"


def test_a_pass_over_all_loads_each_at_most_once(shelf: Shelf, loading: Loading) -> None:
    assert [scene.name for scene in shelf.values()] == ["a", "b", "c"]
    assert sorted(loading.names) == sorted(set(loading.names))


def test_facts_load_nothing(shelf: Shelf, loading: Loading) -> None:
    facts = facts_of(shelf)
    assert list(facts) == ["a", "b", "c"]
    assert facts["a"] == Facts(made("a").digest, made("a").truth_digest, "hci", (4, 5), "remark on a")
    assert facts_of({"a": made("a")}) == {"a": Facts.of(made("a"))}
    assert loading.names == []


def test_a_scene_that_has_changed_is_refused() -> None:
    shelf = Shelf(lambda name: made(name, 9), ROOM)
    for name in ("a", "b", "c"):
        shelf.put(made(name))
    with pytest.raises(UserError, match="a is not what it was when the run began"):
        shelf["a"]


def test_some_of_the_scenes_are_a_shelf_of_their_own(shelf: Shelf, loading: Loading) -> None:
    some = only(shelf, {"a", "c"})
    assert list(some) == ["a", "c"]
    assert loading.names == []
    assert some["a"].name == "a"
    assert only({"a": made("a"), "b": made("b")}, {"b"}).keys() == {"b"}


def test_one_scene_stays_however_large(loading: Loading) -> None:
    shelf = Shelf(loading, 1)
    shelf.put(made("a"))
    assert shelf.held("a") is not None
    shelf.put(made("a"))
    shelf.put(made("b"))
    assert [shelf.held(name) is not None for name in "ab"] == [False, True]
