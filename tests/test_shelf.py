"""A shelf holds what there is room for, and loads the rest again, unchanged."""

import numpy as np
import pytest

import matbench
from matbench import shelf as module
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


def in_memory(shelf: Shelf) -> list[str]:
    return [name for name in shelf if name in shelf._held]


def test_what_was_asked_for_least_recently_goes_and_comes_back(shelf: Shelf, loading: Loading) -> None:
    assert (list(shelf), len(shelf), "a" in shelf, "z" in shelf) == (["a", "b", "c"], 3, True, False)
    assert in_memory(shelf) == ["b", "c"]
    assert shelf["b"].name == "b"
    assert shelf["a"].digest == made("a").digest
    assert in_memory(shelf) == ["a", "b"], "c was the last asked for"
    assert held(shelf, "c") is not None
    assert loading.names == [], "what is put aside is not loaded again"


def test_what_is_put_aside_comes_back_as_it_was(loading: Loading) -> None:
    shelf = Shelf(loading, 1)
    world = matbench.load_scene("synthetic/world-3[size=48x36 predict=right]")
    for scene in (world, made("a"), made("b")):
        shelf.put(scene)
    assert in_memory(shelf) == ["b"]
    back = shelf[world.name]
    assert (back.digest, back.truth_digest, back.name) == (world.digest, world.truth_digest, world.name)
    assert back.held_out is not None
    assert world.held_out is not None
    assert np.array_equal(back.held_out.image, world.held_out.image)
    for own, other in ((back.regions, world.regions), (back.visible, world.visible), (back.truth, world.truth)):
        assert own.keys() == other.keys()
        assert all(np.array_equal(own[key], other[key], equal_nan=True) for key in own)  # type: ignore[index]
    assert not any(array.flags.writeable for array in (back.views, back.held_out.image, *back.truth.values()))
    assert loading.names == []
    shelf.put(made("a", 7))
    shelf.put(made("b"))
    assert shelf["a"].views.max() == 7, "put again, it is the new one"


def test_where_nothing_can_be_put_aside_each_is_loaded_at_most_once_a_pass(
    loading: Loading, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError("no room")

    monkeypatch.setattr(module, "TemporaryFile", full)
    shelf = Shelf(loading, ROOM)
    for name in ("a", "b", "c"):
        shelf.put(made(name))
    assert [shelf.held(name) is not None for name in shelf] == [False, True, True]
    assert [scene.name for scene in shelf.values()] == ["a", "b", "c"]
    assert loading.names
    assert sorted(loading.names) == sorted(set(loading.names))


def test_facts_load_nothing(shelf: Shelf, loading: Loading) -> None:
    facts = facts_of(shelf)
    assert list(facts) == ["a", "b", "c"]
    assert facts["a"] == Facts(made("a").digest, made("a").truth_digest, "hci", (4, 5), "remark on a")
    assert facts_of({"a": made("a")}) == {"a": Facts.of(made("a"))}
    assert loading.names == []


def test_a_scene_that_has_changed_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Shelf, "_put_aside", lambda *_: None)
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
    assert loading.names == [], "what was put aside there is known here"
    assert only({"a": made("a"), "b": made("b")}, {"b"}).keys() == {"b"}


def test_one_scene_stays_however_large(loading: Loading) -> None:
    shelf = Shelf(loading, 1)
    shelf.put(made("a"))
    assert shelf.held("a") is not None
    shelf.put(made("a"))
    shelf.put(made("b"))
    assert in_memory(shelf) == ["b"]
