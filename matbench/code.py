"""One digest of code, over all that a method imports; a changed comment does not change it.

Nothing is executed. Sources are read and their imports followed: import statements, also relative ones and those in
functions, and `importlib.import_module` with a literal text. How a module counts depends on where it comes from:

- by its content: the harness, the method's own project, and all that is not installed with a version (an editable
  package, a file beside a plug-in);
- by name and version: other installed packages;
- not at all: the standard library.

Content is the syntax tree without docstrings, so comments and formatting do not count. The tree is written field by
field, without empty fields: so other versions of Python give the same digest, as long as their grammar is the same.
"""

import importlib.util
import json
import os
import sys
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from errno import EFBIG
from functools import cache
from hashlib import file_digest, sha256
from importlib.machinery import EXTENSION_SUFFIXES, SOURCE_SUFFIXES, ModuleSpec, PathFinder
from pathlib import Path

from attrs import define, field, frozen

from matbench.syntax import Facts, Import, facts

HARNESS = "matbench"
NOT_THERE = "none"
_LARGEST_SOURCE, _LARGEST = 1 << 23, 1 << 32  # bytes; reading a source as one takes a hundred times its size
_SUFFIXES = (*EXTENSION_SUFFIXES, *SOURCE_SUFFIXES)
_INSTALLED = ("site-packages", "dist-packages")
# (importer, module) not followed: `Scene.scored_regions` needs ground truth, which no method is given; where compiled
# kernels are kept changes no answer
_ASIDE = {("matbench.scene", "matbench.regions"), ("matbench.algorithms.kernels", "matbench.plans.kernel_cache")}


@frozen
class Code:
    """The modules and packages that some code consists of.

    Parameters
    ----------
    parts
        Module -> digest of its content, or distribution -> its version; ``none`` if it is not installed. The name
        of a module beside a plug-in begins with a dot.
    files
        Module -> its file, for all modules that count by their content.
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
    """The code behind a module, or behind its name `attribute`; without parts if there is no such module."""
    top = name.partition(".")[0]
    reader = _Reader(None, frozenset(_owners(top)))
    reader.follow("", Import(0, name, attribute))
    return reader.read()


def of_file(path: Path, alone: bool = False) -> Code:
    """The code behind a Python file and all that it imports; with `alone`, the file and nothing else.

    Raises
    ------
    OSError
        If it cannot be read.
    """
    found = _facts(path, is_package=False)
    name = f".{path.stem}"
    if alone:
        return Code({name: found.digest}, {name: path})
    reader = _Reader(path.parent, frozenset())
    reader.count(_Found(name, str(path), None))
    return reader.read()


def lies_beside(folder: Path, top: str) -> bool:
    """Does ``import top``, in a file of that folder, mean something that lies in the folder?

    The rules are those for a script: files there come before installed packages; a folder without ``__init__.py``
    comes after them. ``import matbench`` always means the harness that runs.
    """
    if top == HARNESS or top in sys.builtin_module_names:
        return False
    found = _in_folders(top, [str(folder)])
    return found is not None and (found.file is not None or _installed(top) is None)


@frozen
class _Found:
    """A module: its file (None for a namespace package), and the folders of its submodules (None if it has none)."""

    name: str
    file: str | None
    inside: tuple[str, ...] | None


@define
class _Reader:
    """Follows imports from module to module.

    Parameters
    ----------
    folder
        The folder of a plug-in. Its modules are named as if their package had an empty name: ``.mine``, ``.helper``.
    own
        The distributions that the method itself comes from. Their files are followed, too.
    """

    folder: Path | None
    own: frozenset[tuple[str, str]]
    parts: dict[str, str] = field(factory=dict)
    files: dict[str, Path] = field(factory=dict)
    _todo: deque[tuple[_Found, Facts]] = field(factory=deque)
    _places: dict[str, "_Found | None"] = field(factory=dict)
    _seen: set[tuple[str, str]] = field(factory=set)

    def read(self) -> Code:
        """Follow the imports of all modules counted so far, and of those found on the way."""
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
            is_source = path.suffix in SOURCE_SUFFIXES
            found = _facts(path, module.inside is not None) if is_source else Facts(_digest(path))
        except OSError:  # who imports it gets the error
            self.parts[module.name] = "unreadable"
            return
        self.files[module.name] = path
        self.parts[module.name] = found.digest
        self._todo.append((module, found))

    def follow(self, importer: str, what: Import) -> None:
        """Count what an import brings in."""
        name = self._meant(importer, what.module)
        wanted = {(importer, name), (importer, f"{name}.{what.name}")}
        if not wanted.isdisjoint(_ASIDE) or (name, what.name) in self._seen:
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
        """Count a package from which a module is imported: the package's own code runs as well.

        Packages of the harness are left out. They do nothing but import names, and each name is followed alone.
        """
        found = self._find(name)
        if found is not None and not _is_harness(found):
            self.count(found)

    def _take(self, module: _Found, what: Import) -> None:
        """Count what is imported from a module; all of the module if no name is given."""
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
        elif not what.is_attribute:  # the name is defined in the package's own file
            self.count(module)

    def _names(self, package: _Found) -> Mapping[str, Import]:
        """Name -> import, for the names that a package itself imports."""
        if package.file is not None and package.file.endswith(tuple(SOURCE_SUFFIXES)):
            with suppress(OSError):
                return _facts(Path(package.file), is_package=True).names
        return {}

    def _meant(self, importer: str, name: str) -> str:
        """The full name of an absolute import. It begins with a dot if it means a file beside the plug-in."""
        top = name.partition(".")[0]
        if self.folder is None or not top or not importer.startswith(".") or importer == f".{top}":
            return name  # a file that imports its own name means an installed module
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


def _facts(path: Path, is_package: bool) -> Facts:
    """What a source tells; of a file that is larger than any source, the digest of its bytes and nothing else."""
    if path.stat().st_size > _LARGEST_SOURCE:
        return Facts(_digest(path))
    return facts(path.read_bytes(), is_package)


def _digest(path: Path) -> str:
    """SHA-256 of a file, which is never in memory as a whole.

    Raises
    ------
    OSError
        If it cannot be read, or is larger than any module.
    """
    with path.open("rb") as file:
        if os.fstat(file.fileno()).st_size > _LARGEST:
            raise OSError(EFBIG, os.strerror(EFBIG), str(path))
        return file_digest(file, "sha256").hexdigest()


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
    """Look for a module in several folders, as Python does. `last` is the last part of its name."""
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
    """The module that ``import top`` finds in any file, without a look beside plug-ins."""
    with suppress(ImportError, ValueError, AttributeError):  # whatever odd modules and finders raise
        return _of_spec(top, importlib.util.find_spec(top))
    return None


def _by_finders(name: str, inside: Sequence[str]) -> _Found | None:
    """Look for a module that only a special finder knows, such as that of an editable installation."""
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
    """Name and version of the distributions that have installed a module; none if its content counts instead."""
    if top == HARNESS or top in sys.stdlib_module_names:
        return ()
    found = _installed(top)
    places = found.inside if found and found.inside else (found.file,) if found and found.file else ()
    roots = {os.path.dirname(place) for place in places}  # noqa: PTH120
    return tuple(sorted({_name_and_version(info) for root in roots for info in _holding(top, root)}))


def _holding(top: str, root: str) -> list[Path]:
    """The metadata of those distributions in a folder that hold a module.

    `importlib.metadata` is not used here: it would read all files of all distributions, which takes much longer.
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
    """Name and version, from the name of the metadata's folder: ``opencv_python-4.10.dist-info``."""
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
