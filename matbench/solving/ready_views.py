"""Views of scenes that a run has in memory, for its keepers: so that they do not read, or render, them again."""

from collections import Counter
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path

from matbench.plans.plan import Cell
from matbench.scene import Scene
from matbench.scenes import views_only
from matbench.shelf import held
from matbench.spec import read_scene


class ReadyViews:
    """Files of views, each from the first cell of its scene until the last: few of them lie there at a time.

    Whoever takes one checks its digest: a method may have reached it.

    Parameters
    ----------
    folder
        A folder of its own.
    scenes
        Name -> scene.
    cells
        Those that will be solved.
    """

    def __init__(self, folder: Path, scenes: Mapping[str, Scene], cells: Iterable[Cell]) -> None:
        every = list(cells)
        # another choice of the same views may hold the one that is withheld: then none lies there
        withheld = any("predict" in read_scene(cell.scene).options for cell in every)
        self._folder, self._scenes = folder, {} if withheld else scenes
        self._sizes: dict[str, int] = {}
        self._left = Counter(cell.scene_digest for cell in every)

    def of(self, cell: Cell) -> tuple[Path, int] | None:
        """The file with the views of a cell's scene, and its size; None if it is not known or cannot be written."""
        path = self._path(cell)
        if (scene := held(self._scenes, cell.scene)) is None:
            return None
        with suppress(OSError):
            if not path.exists():
                views_only.write_views(scene, path)
                self._sizes[cell.scene_digest] = path.stat().st_size
            return path, self._sizes[cell.scene_digest]
        with suppress(OSError):  # half of it is worse than nothing
            path.unlink()
        return None

    def done(self, cell: Cell) -> None:
        """One of the cells is done."""
        self._left[cell.scene_digest] -= 1
        if self._left[cell.scene_digest] <= 0:
            with suppress(OSError):
                self._path(cell).unlink()

    def _path(self, cell: Cell) -> Path:
        return self._folder / f"{cell.scene_digest}.npz"
