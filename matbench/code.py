"""One digest of code: of all that a method really imports, by what that does.

Nothing is executed. Sources are read, and their import statements followed: those in functions too, relative ones,
and `importlib.import_module` with a literal text. Files of the harness, of the method's own project and of whatever
is not installed by its version (an editable package, a file beside a plug-in) count by their content; other people's
packages by name and version; the standard library not at all.

Content is the syntax tree without docstrings: comments and formatting change nothing. It is written down field by
field, empty fields left out, so that a digest does not change with Python as long as the grammar of the file does not.
"""

import importlib.util
import json
import os
import sys
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cache
from hashlib import sha256
from importlib.machinery import EXTENSION_SUFFIXES, SOURCE_SUFFIXES, ModuleSpec, PathFinder
from pathlib import Path

from attrs import define, field, frozen

from matbench.syntax import Facts, Import, facts

HARNESS = "matbench"
NOT_THERE = "none"
_SUFFIXES = (*EXTENSION_SUFFIXES, *SOURCE_SUFFIXES)
_INSTALLED = ("site-packages", "dist-packages")
# `Scene.scored_regions` follows from ground truth, which no method is given
_ASIDE = {("matbench.scene", "matbench.regions")}


@frozen
class Code:
    """What some code consists of.

    Parameters
    ----------
    parts
        Module -> digest of its content, or distribution -> its version, ``none`` if it is not there. A module beside
        a plug-in has a name that begins with a dot.
    files
        Module -> its file, for all that is followed.
    """

    parts: Mapping[str, str]
    files: Mapping[str, Path]

    @property
    def digest(self) -> str:
        """SHA-256 of all parts."""
        return sha256(json.dumps(sorted(self.parts.items())).encode()).hexdigest()

    def beside(self, folder: Path) -> dict[str, Path]:
        """The files of a plug-in and of what it imports from its own folder: path below that folder -> file."""
        own = [file for name, file in self.files.items() if name.startswith(".")]
        return {file.relative_to(folder).as_posix(): file for file in own}


def of_module(name: str, attribute: str = "") -> Code:
    """The code behind a module, or behind what it calls `attribute`; empty parts if there is no such module."""
    top = name.partition(".")[0]
    reader = _Reader(None, frozenset(_owners(top)))
    reader.follow("", Import(0, name, attribute))
    return reader.read()


def of_file(path: Path, alone: bool = False) -> Code:
    """The code behind a Python file, and that beside it which it imports; `alone` takes the file and nothing else.

    Raises
    ------
    OSError
        If it cannot be read.
    """
    found = facts(path.read_bytes(), is_package=False)
    name = f".{path.stem}"
    if alone:
        return Code({name: found.digest}, {name: path})
    reader = _Reader(path.parent, frozenset())
    reader.count(_Found(name, str(path), None))
    return reader.read()


def of_content(path: Path) -> str:
    """SHA-256 of a file, or of all files below a folder with their names.

    Raises
    ------
    OSError
        If one cannot be read.
    """
    if not path.is_dir():
        return sha256(path.read_bytes()).hexdigest()
    files = sorted(file for file in path.rglob("*") if file.is_file())
    each = [f"{file.relative_to(path).as_posix()}\0{of_content(file)}" for file in files]
    return sha256("\0".join(each).encode()).hexdigest()


def lies_beside(folder: Path, top: str) -> bool:
    """Does ``import top`` mean what lies in the folder of the file that says so?

    As for a script: files there come before what is installed, a folder that is no regular package after it. The
    harness is always the one that runs.
    """
    if top == HARNESS or top in sys.builtin_module_names:
        return False
    found = _in_folders(top, [str(folder)])
    return found is not None and (found.file is not None or _installed(top) is None)


@frozen
class _Found:
    """A module: its file (none for a namespace package), and where submodules lie if it is a package."""

    name: str
    file: str | None
    inside: tuple[str, ...] | None


@define
class _Reader:
    """Follows imports from module to module.

    Parameters
    ----------
    folder
        That of a plug-in; its modules are named as in a package without a name, ``.mine`` and ``.helper``.
    own
        The distributions that the method itself comes from: their files are followed, too.
    """

    folder: Path | None
    own: frozenset[tuple[str, str]]
    parts: dict[str, str] = field(factory=dict)
    files: dict[str, Path] = field(factory=dict)
    _todo: deque[tuple[_Found, Facts]] = field(factory=deque)
    _places: dict[str, "_Found | None"] = field(factory=dict)
    _seen: set[tuple[str, str]] = field(factory=set)

    def read(self) -> Code:
        """Follow whatever is left to follow."""
        while self._todo:
            module, found = self._todo.popleft()
            for one in found.imports:
                self.follow(module.name, _absolute(one, module))
        return Code(self.parts, self.files)

    def count(self, module: _Found) -> None:
        """Count a module, and note that its imports are to be followed."""
        if module.file is None or module.name in self.parts:
            return
        path = Path(module.file)
        try:
            content = path.read_bytes()
        except OSError:  # whoever imports it is told so
            self.parts[module.name] = "unreadable"
            return
        self.files[module.name] = path
        if path.suffix in SOURCE_SUFFIXES:
            found = facts(content, module.inside is not None)
            self.parts[module.name] = found.digest
            self._todo.append((module, found))
        else:
            self.parts[module.name] = sha256(content).hexdigest()

    def follow(self, importer: str, what: Import) -> None:
        """Count what an import brings in."""
        name = self._meant(importer, what.module)
        if (importer, name) in _ASIDE or (name, what.name) in self._seen:
            return
        self._seen.add((name, what.name))
        top = name.partition(".")[0]
        if top and top != HARNESS:
            if top in sys.stdlib_module_names:
                return
            owners = _owners(top)
            if owners and not self.own.intersection(owners):
                self.parts.update(owners)
                return
        found = self._find(name)
        if found is not None:
            for parent in _parents(name):
                self._enter(parent)
            self._take(found, what)
        elif not what.is_attribute:  # an attribute may be anything
            self.parts.setdefault(name, NOT_THERE)

    def _enter(self, name: str) -> None:
        """Count a package that something else is imported from: its own code runs as well.

        Those of the harness are known to do nothing but give names, each of which is followed alone.
        """
        found = self._find(name)
        if found is not None and not _is_harness(found):
            self.count(found)

    def _take(self, module: _Found, what: Import) -> None:
        """Count what is taken from a module that was found, or all of it."""
        if module.inside is None or not _is_harness(module):
            self.count(module)
        if module.inside is None or not what.name:
            return
        names = self._names(module)
        if what.name == "*":
            for one in names.values():
                self.follow(module.name, _absolute(one, module))
        if what.name in names:
            self.follow(module.name, _absolute(names[what.name], module))
        elif (sub := self._find(f"{module.name}.{what.name}")) is not None:
            self._take(sub, Import(0, sub.name))
        elif not what.is_attribute:  # it is written there
            self.count(module)

    def _names(self, package: _Found) -> Mapping[str, Import]:
        """The names that a package takes from elsewhere, and where from."""
        if package.file is not None and package.file.endswith(tuple(SOURCE_SUFFIXES)):
            with suppress(OSError):
                return facts(Path(package.file).read_bytes(), is_package=True).names
        return {}

    def _meant(self, importer: str, name: str) -> str:
        """The name under which an absolute import is found: beside the plug-in, if it is said there."""
        top = name.partition(".")[0]
        if self.folder is None or not top or not importer.startswith(".") or importer == f".{top}":
            return name  # a file that imports its own name means another
        return f".{name}" if lies_beside(self.folder, top) else name

    def _find(self, name: str) -> _Found | None:
        if name not in self._places:
            self._places[name] = self._looked_for(name)
        return self._places[name]

    def _looked_for(self, name: str) -> _Found | None:
        parent, _, last = name.rpartition(".")
        if not name:
            return _Found("", None, (str(self.folder),)) if self.folder is not None else None
        if "." not in name:
            return _installed(name)
        package = self._find(parent)
        if package is None or package.inside is None:
            return None
        found = _in_folders(last, package.inside)
        return _Found(name, found.file, found.inside) if found else _by_finders(name, package.inside)


def _is_harness(module: _Found) -> bool:
    return module.name.partition(".")[0] == HARNESS


def _parents(name: str) -> Iterator[str]:
    """``a`` and ``a.b`` of ``a.b.c``."""
    parts = name.split(".")
    for count in range(1, len(parts)):
        yield ".".join(parts[:count])


def _absolute(what: Import, where: _Found) -> Import:
    """An import with its dots resolved, as if it were written with the whole name."""
    if not what.level:
        return what
    package = where.name if where.inside is not None else where.name.rpartition(".")[0]
    for _ in range(what.level - 1):
        package = package.rpartition(".")[0]
    # beside a plug-in the package has no name: what lies in it begins with a dot
    whole = f"{package}.{what.module}" if what.module else package
    return Import(0, whole, what.name, what.is_attribute)


def _in_folders(last: str, folders: Sequence[str]) -> _Found | None:
    """A module of that name in one of several folders, as Python looks for it; named by its last part."""
    portions = []
    for folder in folders:
        base = os.path.join(folder, last)  # noqa: PTH118 (asked a hundred times a start)
        if os.path.isfile(init := os.path.join(base, "__init__.py")):  # noqa: PTH113, PTH118
            return _Found(last, init, (base,))
        for suffix in _SUFFIXES:
            if os.path.isfile(base + suffix):  # noqa: PTH113
                return _Found(last, base + suffix, None)
        if os.path.isdir(base):  # noqa: PTH112
            portions.append(base)
    return _Found(last, None, tuple(portions)) if portions else None


def _installed(top: str) -> _Found | None:
    """What ``import top`` finds for everyone."""
    with suppress(ImportError, ValueError, AttributeError):  # whatever odd modules and finders raise
        return _of_spec(top, importlib.util.find_spec(top))
    return None


def _by_finders(name: str, inside: Sequence[str]) -> _Found | None:
    """A module that only a finder of its own knows, as those of editable installations do."""
    for finder in sys.meta_path:
        if finder is not PathFinder:
            with suppress(Exception):
                if spec := finder.find_spec(name, list(inside), None):
                    return _of_spec(name, spec)
    return None


def _of_spec(name: str, spec: ModuleSpec | None) -> _Found | None:
    if spec is None or not (spec.has_location or spec.submodule_search_locations):
        return None
    inside = spec.submodule_search_locations
    return _Found(name, spec.origin if spec.has_location else None, None if inside is None else tuple(inside))


@cache
def _owners(top: str) -> tuple[tuple[str, str], ...]:
    """The distributions, name and version, that have installed a module where it lies; none if it is followed."""
    if top == HARNESS or top in sys.stdlib_module_names:
        return ()
    found = _installed(top)
    places = found.inside if found and found.inside else (found.file,) if found and found.file else ()
    roots = {os.path.dirname(place) for place in places}  # noqa: PTH120
    return tuple(sorted({_name_and_version(info) for root in roots for info in _holding(top, root)}))


def _holding(top: str, root: str) -> list[Path]:
    """The metadata, in a folder that packages are installed in, of those that hold a module.

    They are looked through rather than `importlib.metadata` asked, which reads all files of all of them.
    """
    every = [info for info in _metadata(root) if not _is_editable(info)]
    named = [info for info in every if _name_and_version(info)[0] == top.lower().replace("_", "-")]
    if named:
        return named
    listed = {info: _lines(info / "top_level.txt") for info in every}
    told = [info for info, tops in listed.items() if top in tops]
    begins = f"{top}/", f"{top}."
    return told or [
        info
        for info, tops in listed.items()
        if not tops and any(line.startswith(begins) for line in _lines(info / "RECORD"))
    ]


@cache
def _metadata(root: str) -> tuple[Path, ...]:
    kinds = (
        (".dist-info", ".egg-info") if Path(root).name in _INSTALLED else (".dist-info",)
    )  # a source tree has the latter
    with suppress(OSError):
        return tuple(Path(root, name) for name in sorted(os.listdir(root)) if name.endswith(kinds))  # noqa: PTH208
    return ()


def _name_and_version(info: Path) -> tuple[str, str]:
    """As they stand in the name of a distribution's metadata: ``opencv_python-4.10.dist-info``."""
    name, _, version = info.stem.partition("-")
    return name.lower().replace("_", "-"), version.partition("-")[0]


@cache
def _is_editable(info: Path) -> bool:
    with suppress(OSError, ValueError, AttributeError):
        told = json.loads((info / "direct_url.json").read_text(encoding="utf-8"))
        return bool(told.get("dir_info", {}).get("editable"))
    return False


@cache
def _lines(file: Path) -> tuple[str, ...]:
    with suppress(OSError):
        return tuple(file.read_text(encoding="utf-8", errors="replace").splitlines())
    return ()
