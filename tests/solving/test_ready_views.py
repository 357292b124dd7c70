"""Views that a run has in memory are handed to keepers, which take no others for them."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from matbench.plans.plan import Cell
from matbench.scene import Range, Scene
from matbench.scenes import views_only
from matbench.solving.keeper_process import _copied
from matbench.solving.ready_views import ReadyViews


def made(name: str, grey: int = 0) -> Scene:
    views = np.full((2, 4, 5, 3), grey, np.uint8)
    return Scene(name, views, ("a", "b"), 0, Range(0, 2), {0: np.ones((4, 5), np.float32)}, 1)


def cell_on(scene: Scene) -> Cell:
    return SimpleNamespace(scene=scene.name, scene_digest=scene.digest)  # type: ignore[return-value]


@pytest.fixture
def ready(tmp_path: Path) -> tuple[ReadyViews, Cell, Scene]:
    scene = made("a/b", 7)
    cell = cell_on(scene)
    return ReadyViews(tmp_path, {scene.name: scene}, [cell, cell]), cell, scene


def test_a_file_lies_there_until_the_last_cell_of_its_scene(ready: tuple[ReadyViews, Cell, Scene]) -> None:
    views, cell, scene = ready
    given = views.of(cell)
    assert given is not None
    assert views.of(cell) == given
    found = views_only.read_views(given[0])
    assert (found.digest, dict(found.truth)) == (scene.digest, {})
    views.done(cell)
    assert given[0].stat().st_size == given[1]
    views.done(cell)
    assert not given[0].exists()


def test_what_is_not_in_memory_or_cannot_be_written_is_left_to_the_keeper(tmp_path: Path) -> None:
    scene = made("a/b")
    assert ReadyViews(tmp_path, {}, []).of(cell_on(scene)) is None
    assert ReadyViews(tmp_path / "gone", {scene.name: scene}, []).of(cell_on(scene)) is None


def test_a_keeper_takes_no_other_views(tmp_path: Path, ready: tuple[ReadyViews, Cell, Scene]) -> None:
    views, cell, _ = ready
    given, own = views.of(cell), tmp_path / "own.npz"
    assert given is not None
    path, size = given
    assert _copied(path, size, own, cell)
    for other in (made("a/b", 8), made("a/c", 7)):  # as a method might leave them there
        views_only.write_views(other, path)
        assert not _copied(path, path.stat().st_size, own, cell)
    path.write_bytes(b"0" * size)
    assert not _copied(path, size, own, cell)
    path.write_bytes(b"0" * (size + 1))
    assert not _copied(path, size, own, cell)
    assert own.stat().st_size == size, "nothing of another size is read"
    path.unlink()
    assert not _copied(path, size, own, cell)


def test_where_a_view_is_withheld_no_other_choice_of_the_views_lies_ready(tmp_path: Path) -> None:
    whole, part = made("a/b", 7), made("a/b[predict=right]", 7)
    cells = [cell_on(whole), cell_on(part)]
    views = ReadyViews(tmp_path, {scene.name: scene for scene in (whole, part)}, cells)
    assert [views.of(cell) for cell in cells] == [None, None]
    assert list(tmp_path.iterdir()) == []
    views.done(cells[0])
