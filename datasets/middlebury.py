"""The Middlebury scenes of 2001, 2003, 2005 and 2006, as their site lays them out.

Below the data root lie ``middlebury/scenes2001/data/SCENE``, ``middlebury/scenes2003/newdata/SCENE`` and
``middlebury/scenes2003/newdata/half/SCENE``, ``middlebury/scenes2005/ThirdSize/SCENE`` and so on. Truth is stored as
grey levels: so many, a whole number, for each pixel of disparity between the two views of the field's pair.

References: Scharstein & Szeliski, IJCV 2002 (2001); Scharstein & Szeliski, CVPR 2003 (2003);
Scharstein & Pal, CVPR 2007, and Hirschmueller & Scharstein, CVPR 2007 (2005, 2006).
"""

import re
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path, PurePosixPath

from attrs import frozen

from matbench.datasets.registry import YEARS, Facts, Layout, Registry, registry, site
from matbench.datasets.stored import EXTENSIONS, StoredScene, TruthFile, check_options, image_file
from matbench.errors import UserError, unknown
from matbench.files.images import has_pixels, read_size
from matbench.scene import Range, Scene
from matbench.scenes.dataset import Download, Listing, Remote

_PREFIXES = ("im", "view")


@frozen
class Middlebury:
    """One year's scenes: those of the registry, and those that only the data root has.

    Where no size is asked for, it is the first of the year's layouts in which the scene is present.
    """

    year: str

    @property
    def known(self) -> Registry:
        return registry(self.year)

    def listings(self, root: Path | None) -> Sequence[Listing]:
        """All scenes of the year, with those that only the data root has."""
        names = sorted({*self.known.scenes, *self._names_present(root)}, key=lambda name: (name.lower(), name))
        return [self._listing(name, root) for name in names]

    def _listing(self, name: str, root: Path | None) -> Listing:
        facts = self.known.scenes.get(name, {})
        here = self._sizes_present(name, root)
        sizes = {
            size: (facts[size].size if size in facts else None) or self._size_of(name, size, root)
            for size in (*here, *(size for size in facts if size not in here))
        }
        complete = frozenset(size for size in here if root is not None and self._is_complete(root, name, size))
        return Listing(
            name,
            len(self._layout(name, next(iter([*sizes, *self.known.layouts]))).numbers),
            sizes,
            bool(here) and here[0] in complete,
            complete=complete,
            truth=any(fact.truth for fact in facts.values()) or (not facts and bool(complete)),
        )

    def _is_complete(self, root: Path, name: str, size: str) -> bool:
        """Are all views present, and some truth unless none was published?"""
        folder, layout = self._folder(root, name, size), self._layout(name, size)
        return all(image_file(folder, layout.view.format(k)).is_file() for k in layout.numbers) and (
            self._lacks_truth(name, size)
            or any(image_file(folder, layout.truth.format(k)).is_file() for k in layout.with_truth)
        )

    def _lacks_truth(self, name: str, size: str) -> bool:
        """Is it known that no truth of this scene was published?"""
        facts = self.known.scenes.get(name, {})
        return size in facts and not facts[size].truth

    def downloads(self) -> Mapping[str, Mapping[str, Download]]:
        """Scene -> size -> where its files can be had; a scene whose files are not known has no size."""
        return {
            name: {size: self._download(name, size, facts) for size, facts in sizes.items()}
            for name, sizes in self.known.scenes.items()
        }

    def _download(self, name: str, size: str, facts: Facts) -> Download:
        layout = self._layout(name, size)
        default = next(iter(self.known.scenes[name]))
        alias = {layout.view.format(k): layout.alias.format(k) for k in layout.numbers} if layout.alias else {}
        return Download(
            f"middlebury{self.year}/{name}" + (f"[size={size}]" if size != default else ""),
            folder=PurePosixPath("middlebury", layout.folder, name),
            files=tuple(
                Remote(
                    file,
                    count,
                    sha256,
                    also=tuple(f"{Path(file).stem}{end}" for end in EXTENSIONS if not file.endswith(end)),
                    offered_as=tuple(f"{alias[stem]}{end}" for end in EXTENSIONS if (stem := Path(file).stem) in alias),
                    holds=partial(has_pixels, digest=pixels),
                )
                for file, (count, sha256, pixels) in facts.files.items()
            ),
            site=site(),
            sources=tuple(source.format(scene=name) for source in layout.sources),
        )

    def load(self, name: str, options: Mapping[str, str], root: Path | None) -> Scene:
        """Load a scene: its chosen views and their truth.

        Parameters
        ----------
        options
            `size`, and those of `stored.OPTIONS`.

        Raises
        ------
        UserError
            If the scene or an option does not exist, or a file is missing or damaged.
        """
        called = f"middlebury{self.year}/{name}"
        check_options(called, options, ("size",))
        folder, size = self._locate(called, name, options.get("size"), root)
        layout, facts = self._layout(name, size), self.known.scenes.get(name, {}).get(size)
        index = {number: place for place, number in enumerate(layout.numbers)}
        files = {index[number]: image_file(folder, layout.truth.format(number)) for number in layout.with_truth}
        scale = layout.grey * layout.steps
        truth = {view: TruthFile(file, scale, layout.unknown) for view, file in files.items() if file.is_file()}
        if not truth and not self._lacks_truth(name, size):
            raise UserError(f"{called} has no ground truth in {folder}: a scene without it cannot be scored")
        largest = facts.largest if facts else layout.largest
        return StoredScene(
            called=called,
            views=tuple(image_file(folder, layout.view.format(number)) for number in layout.numbers),
            labels=tuple(layout.label.format(number) for number in layout.numbers),
            disparities=None if largest is None else Range(0, largest / layout.steps),
            truth=truth,
            pair_steps=layout.steps,
            preferred=tuple(truth) or tuple(sorted(index.values(), key=lambda view: view != index[layout.pair[0]])),
            prefixes=_PREFIXES,
        ).load(options)

    def _locate(self, called: str, name: str, size: str | None, root: Path | None) -> tuple[Path, str]:
        """The folder of a scene and its size.

        Raises
        ------
        UserError
            If the scene or size does not exist, or is not there.
        """
        known, present = self.known.scenes, self._names_present(root)
        # the name comes from the command line: only one that is known is ever joined to a path
        if name not in known and name not in present:
            raise unknown(f"scene of middlebury{self.year}", name, {*known, *present})
        here = self._sizes_present(name, root)
        possible = [s for s in self.known.layouts if s in known.get(name, {}) or s in here]
        if size is not None and size not in possible:
            raise unknown(f"size of {called}", size, possible)
        wanted = size or next(iter([*here, *possible]), "")
        bring = ""
        if wanted in known.get(name, {}):
            bring = f"; {self._download(name, wanted, known[name][wanted]).command} brings it"
        if root is None:
            raise UserError(
                f"{called} is a real scene: name the folder that holds middlebury/ by --data or MATBENCH_DATA{bring}"
            )
        if not wanted:
            raise UserError(f"{called} is not under {root / 'middlebury'}, and no file of it is known: nothing to load")
        folder = self._folder(root, name, wanted)
        if wanted not in here:
            others = f"size {', '.join(here)}" if here else ", ".join(present) or "no scenes of that year"
            raise UserError(f"{called} (size {wanted}) is not in {folder}: present: {others}{bring}")
        return folder, wanted

    def _layout(self, name: str, size: str) -> Layout:
        return self.known.special.get(name, self.known.layouts[size])

    def _folder(self, root: Path, name: str, size: str) -> Path:
        return root / "middlebury" / self._layout(name, size).folder / name

    def _is_present(self, name: str, size: str, root: Path) -> bool:
        """Does the folder hold any view of that layout?"""
        folder, layout = self._folder(root, name, size), self._layout(name, size)
        return any(image_file(folder, layout.view.format(number)).is_file() for number in layout.numbers)

    def _sizes_present(self, name: str, root: Path | None) -> list[str]:
        """The sizes of a scene of that checked name, in order of preference."""
        return [size for size in self.known.layouts if root is not None and self._is_present(name, size, root)]

    def _names_present(self, root: Path | None) -> list[str]:
        if root is None:
            return []
        parents = {size: root / "middlebury" / layout.folder for size, layout in self.known.layouts.items()}
        return sorted(
            {
                path.name
                for size, parent in parents.items()
                if parent.is_dir()
                for path in parent.iterdir()
                if re.fullmatch(r"[A-Za-z0-9_]+", path.name) and self._is_present(path.name, size, root)
            }
        )

    def _size_of(self, name: str, size: str, root: Path | None) -> tuple[int, int]:
        """(width, height) as the first view's header states it; (0, 0) if there is none."""
        if root is None:
            return 0, 0
        folder, layout = self._folder(root, name, size), self._layout(name, size)
        paths = (image_file(folder, layout.view.format(number)) for number in layout.numbers)
        try:
            return read_size(next(path for path in paths if path.is_file()))
        except (UserError, StopIteration):
            return 0, 0


MIDDLEBURY_2001, MIDDLEBURY_2003, MIDDLEBURY_2005, MIDDLEBURY_2006 = map(Middlebury, YEARS)
