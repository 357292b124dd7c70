"""Finding methods, datasets and metrics: through entry points, and in a user's own file."""

import importlib.util
import inspect
import os
import re
import sys
from collections.abc import Iterable, Mapping
from functools import cache
from hashlib import sha256
from importlib.metadata import EntryPoint, entry_points, version
from pathlib import Path
from types import ModuleType
from typing import Any, Literal

from attrs import frozen

from matbench.errors import UserError, unknown
from matbench.spec import build, first_line

Group = Literal["algorithms", "datasets", "metrics"]


@frozen
class Plugin:
    """Something that can be loaded under a name.

    Parameters
    ----------
    name
        What a user types.
    source
        Where it comes from: a distribution's name, or the path of a file.
    entry
        An entry point, or a class from a user's own file.
    """

    name: str
    source: str
    entry: EntryPoint | type

    def load(self) -> Any:
        """The object itself.

        Raises
        ------
        UserError
            If its module fails to import, whatever the reason.
        """
        if isinstance(self.entry, type):
            return self.entry
        try:
            return self.entry.load()
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # whatever a module does when imported, sys.exit included
            why = f"{type(error).__name__}: {first_line(error)}"
            raise UserError(f"plug-in {self.name!r} from {self.source} cannot be imported: {why}") from error

    def make(self, params: Mapping[str, object]) -> Any:
        """An instance with these parameters, as values or as typed, the others at their defaults.

        Raises
        ------
        UserError
            If its module fails to import, or for a parameter or a value that it does not take.
        """
        return build(self.name, self.load(), params)


@cache
def installed(group: Group) -> Mapping[str, Plugin]:
    """The plug-ins of a group that installed distributions offer, by name; the built-in ones too."""
    found = {}
    for entry in entry_points(group=f"matbench.{group}"):
        source = entry.dist.name if entry.dist else "unknown"
        if entry.name not in found or source == "matbench-stereo":  # a built-in name cannot be taken over
            found[entry.name] = Plugin(entry.name, source, entry)
    return found


def snake_case(name: str) -> str:
    """``MyMethod`` -> ``my_method``: how a class is named on the command line."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()


def from_file(path: Path) -> Mapping[str, Plugin]:
    """The methods in a user's own file: every public, concrete class defined there that has a `solve`.

    A class is named after itself in snake case, or by its attribute `name`.

    Raises
    ------
    UserError
        If the file is missing, fails to import, or holds no method.
    """
    if not os.path.isfile(path):  # noqa: PTH113 (False where a folder may not be entered, too)
        raise UserError(f"plug-in file {str(path)!r} does not exist or may not be read: give the path of a Python file")
    module = _import_file(path)
    classes = [c for c in vars(module).values() if isinstance(c, type) and c.__module__ == module.__name__]
    found = {}
    for cls in classes:
        is_hidden = cls.__name__.startswith("_") or inspect.isabstract(cls)
        if callable(getattr(cls, "solve", None)) and not is_hidden:
            given = vars(cls).get("name")
            name = given if isinstance(given, str) else snake_case(cls.__name__)
            if not re.fullmatch(r"[A-Za-z0-9_.-]+", name):
                raise UserError(f"{path}: method name {name!r} may hold letters, digits and _ . - only")
            found[name] = Plugin(name, str(path), cls)
    if not found:
        raise UserError(f"plug-in file {str(path)!r} holds no method: a class with solve(self, scene, context)")
    return found


def _import_file(path: Path) -> ModuleType:
    try:
        content = sha256(path.read_bytes()).hexdigest()[:16]
    except OSError as error:
        raise UserError(f"plug-in file {str(path)!r} cannot be read: {error.strerror}") from error
    name = f"matbench_plugin_{path.stem}_{content}"
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise UserError(f"plug-in file {str(path)!r} is not a Python file: its name must end in .py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # sys.exit included
        del sys.modules[name]
        raise UserError(f"plug-in file {str(path)!r}: {type(error).__name__}: {first_line(error)}") from error
    return module


def algorithms(files: Iterable[Path] = ()) -> dict[str, Plugin]:
    """All methods by name: the installed ones and those in the given files.

    Raises
    ------
    UserError
        If a file cannot be used, or takes the name of another method.
    """
    found = dict(installed("algorithms"))
    for path in files:
        for name, plugin in from_file(path).items():
            if name in found and found[name].source != plugin.source:
                raise UserError(
                    f"{path}: the name {name!r} is taken by {found[name].source}; give the class another name"
                )
            found[name] = plugin
    return found


def algorithm(name: str, files: Iterable[Path] = ()) -> Plugin:
    """The method of that name; a class may be named as written (`MyMethod`) or in snake case."""
    known = algorithms(files)
    for candidate in (name, snake_case(name)):
        if candidate in known:
            return known[candidate]
    raise unknown("algorithm", name, known)


@cache
def code_digest(plugin: Plugin) -> str:
    """SHA-256 of the code that decides a method's answers.

    For a method in a file, that file; otherwise all modules of the package around it (built in:
    all of `algorithms/`, and the modules of the harness that methods compute with); and the
    versions of numpy, numba and OpenCV.
    """
    digest = sha256(_versions().encode())
    here = Path(__file__).parents[1]
    files = [here / "scene.py", here / "space.py", here / "algorithm.py"]
    if isinstance(plugin.entry, type):
        files.append(Path(plugin.source))
    else:
        files += _package_files(plugin.entry.module)
    for file in files:
        digest.update(file.name.encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()


def method_digest(plugin: Plugin, instance: object) -> str:
    """`code_digest`, and that of what the method's `code_files` hold, if it names any.

    Raises
    ------
    UserError
        If one of them cannot be read.
    """
    files = getattr(instance, "code_files", ())
    if not files:
        return code_digest(plugin)
    digest = sha256(code_digest(plugin).encode())
    for file in files:
        try:
            digest.update(sha256(Path(file).read_bytes()).digest())
        except OSError as error:
            raise UserError(f"{plugin.name}: {str(file)!r} cannot be read: {error.strerror}") from error
    return digest.hexdigest()


def _versions() -> str:
    return " ".join(f"{name} {version(name)}" for name in ("numpy", "numba", "opencv-python-headless"))


def kernel_cache() -> Path:
    """Where compiled kernels are kept: a folder for each state of the built-in methods' code.

    numba notices a change of a kernel's own file, not of one that it calls in another.
    """
    digest = sha256(_versions().encode())
    for file in _package_files("matbench.algorithms"):
        digest.update(file.name.encode() + b"\0" + file.read_bytes())
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "matbench" / "kernels" / digest.hexdigest()[:16]


def _package_files(module: str) -> list[Path]:
    parts = module.split(".")
    package = ".".join(parts[:2]) if parts[0] == "matbench" else parts[0]
    spec = importlib.util.find_spec(package)
    if spec is None or spec.origin is None:
        return []
    origin = Path(spec.origin)
    return sorted(origin.parent.rglob("*.py")) if spec.submodule_search_locations else [origin]
