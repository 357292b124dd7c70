"""Finding methods, datasets and metrics: through entry points, and in a user's own file."""

import inspect
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from functools import cache
from hashlib import sha256
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import ModuleType
from typing import Any, Literal

from attrs import frozen

from matbench import code, parameters
from matbench.code import Code
from matbench.errors import UserError, cause, failure, refuse_hidden, unknown
from matbench.files.plain import NotPlain, digest_content
from matbench.plans import kernels
from matbench.plans.own_file import import_file
from matbench.scene import Scene

Group = Literal["algorithms", "datasets", "metrics"]
OWN = "matbench-stereo"
"""The source of the plug-ins that are built in."""


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
            if self.source != OWN and "numba" in code_of(self).parts:
                import_module("matbench.plans.kernel_cache")  # before it defines kernels
            return self.entry.load()
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # whatever a module does when imported, sys.exit included
            raise UserError(f"plug-in {self.name!r} from {self.source} cannot be imported: {failure(error)}") from error

    def make(self, params: Mapping[str, object]) -> Any:
        """An instance with these parameters, as values or as typed, the others at their defaults.

        Raises
        ------
        UserError
            If its module fails to import, or for a parameter or a value that it does not take.
        """
        return parameters.build(self.name, self.load(), params)


@cache
def installed(group: Group) -> Mapping[str, Plugin]:
    """The plug-ins of a group that installed distributions offer, by name; the built-in ones too."""
    found = {}
    for entry in entry_points(group=f"matbench.{group}"):
        source = entry.dist.name if entry.dist else "unknown"
        if entry.name not in found or source == OWN:  # a built-in name cannot be taken over
            found[entry.name] = Plugin(entry.name, source, entry)
    return found


def snake_case(name: str) -> str:
    """``MyMethod`` -> ``my_method``: how a class is named on the command line."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()


def from_file(path: Path, group: Group = "algorithms") -> Mapping[str, Plugin]:
    """What a user's own file offers of one group; see `own_metrics` for its metrics.

    Every public, concrete class defined there is a method if it has a `solve`, and a dataset if it has `listings` and
    `load`. A class is named after itself in snake case, or by its attribute `name`.

    Raises
    ------
    UserError
        If the file is missing, fails to import, or holds no plug-in of any kind.
    """
    module = _module_of(path)
    classes = [c for c in vars(module).values() if isinstance(c, type) and c.__module__ == module.__name__]
    found: dict[str, Plugin] = {}
    is_any = bool(_metrics_in(module))
    for cls in classes:
        kinds = [kind for kind, wanted in _MARKS.items() if all(callable(getattr(cls, name, None)) for name in wanted)]
        if not kinds or cls.__name__.startswith("_") or inspect.isabstract(cls):
            continue
        is_any = True
        given = vars(cls).get("name")
        name = given if isinstance(given, str) else snake_case(cls.__name__)
        if not re.fullmatch(r"[A-Za-z0-9_.-]+", name):
            kind = "method" if "algorithms" in kinds else "dataset"
            raise UserError(f"{path}: {kind} name {name!r} may hold letters, digits and _ . - only")
        if group in kinds:
            found[name] = Plugin(name, str(path), cls)
    if not is_any:
        raise UserError(
            f"plug-in file {str(path)!r} holds no method (a class with solve(self, scene, context)), no dataset "
            "(a class with listings and load) and no Metric or Family"
        )
    return found


_MARKS: Mapping[Group, tuple[str, ...]] = {"algorithms": ("solve",), "datasets": ("listings", "load")}


def own_metrics(path: Path) -> tuple[Any, ...]:
    """The metrics in a user's own file: every one that stands there under a public name, alone or in a list.

    Raises
    ------
    UserError
        As `from_file`.
    """
    from_file(path)
    return _metrics_in(_module_of(path))


def _metrics_in(module: ModuleType) -> tuple[Any, ...]:
    """Whatever looks like a metric; `matbench.results.metric_catalogue.metrics` checks that it is one."""
    public = [value for name, value in vars(module).items() if not name.startswith("_")]
    every = [one for value in public for one in (value if isinstance(value, list | tuple) else [value])]
    return tuple({id(one): one for one in every if not isinstance(one, type) and _seems_metric(one)}.values())


def _seems_metric(one: Any) -> bool:
    """Does it compute what is better or worse, or make metrics for a range of numbers?"""
    marks = {"compute": "better", "make": "least"}
    return any(callable(getattr(one, call, None)) and hasattr(one, mark) for call, mark in marks.items())


def _module_of(path: Path) -> ModuleType:
    refuse_hidden("plug-in file", str(path))
    if not os.path.isfile(path):  # noqa: PTH113 (False where a folder may not be entered, too)
        raise UserError(f"plug-in file {str(path)!r} does not exist or may not be read: give the path of a Python file")
    return import_file(path)


_used: ContextVar[tuple[Path, ...]] = ContextVar("plug-in files", default=())


@contextmanager
def using(files: Iterable[str | Path]) -> Iterator[None]:
    """Within the block, datasets and metrics in users' own files are found by name, as installed ones are.

    They are looked up in many places, also in other processes. Methods need no such block: their callers pass the
    files.

    Raises
    ------
    UserError
        If a file cannot be used, or takes the name of another dataset.
    """
    token = _used.set(tuple(dict.fromkeys(Path(file).resolve() for file in files)))
    try:
        datasets()  # a file that cannot be used is an error here, not somewhere within the block
        yield
    finally:
        _used.reset(token)


def used() -> tuple[Path, ...]:
    """The files of the innermost block of `using`; none outside of any."""
    return _used.get()


def datasets() -> dict[str, Plugin]:
    """All datasets by name: the installed ones and those in the files that are `used`."""
    return _with_files("datasets", used())


def algorithms(files: Iterable[Path] = ()) -> dict[str, Plugin]:
    """All methods by name: the installed ones and those in the given files.

    Raises
    ------
    UserError
        If a file cannot be used, or takes the name of another method.
    """
    return _with_files("algorithms", files)


def _with_files(group: Group, files: Iterable[Path]) -> dict[str, Plugin]:
    found = dict(installed(group))
    for path in files:
        for name, plugin in from_file(path, group).items():
            if name in found and found[name].source != plugin.source:
                raise UserError(
                    f"{path}: the name {name!r} is taken by {found[name].source}; give the class another name"
                )
            found[name] = plugin
    return found


_IN_FILE = re.compile(r"(?P<file>.+\.py):(?P<name>[^:/\\]+)", re.DOTALL)


def is_in_file(name: str) -> bool:
    """Does a name say in which file a method is, as ``FILE.py:Class``?"""
    return _IN_FILE.fullmatch(name) is not None


def algorithm(name: str, files: Iterable[Path] = ()) -> Plugin:
    """The method of that name; a class may be named as written (`MyMethod`) or in snake case.

    ``FILE.py:Class`` is the one in that file, whatever others are called. So two files may hold methods of one name.
    """
    if (found := _IN_FILE.fullmatch(name)) is not None:
        return in_file(Path(found["file"]).resolve(), found["name"])
    if re.fullmatch(r".+\.py:?", name):
        raise UserError(f"unknown algorithm {name!r}: write FILE.py:Class for a method in a file of yours")
    return _named("algorithm", name, algorithms(files))


def in_file(path: Path, name: str) -> Plugin:
    """The method of that name in a user's own file."""
    return _named(f"method of {path}", name, from_file(path))


def _named(kind: str, name: str, known: Mapping[str, Plugin]) -> Plugin:
    for candidate in (name, snake_case(name)):
        if candidate in known:
            return known[candidate]
    raise unknown(kind, name, known)


def code_of(plugin: Plugin) -> Code:
    """All code that a plug-in depends on, as it is now: its module and all that this imports.

    Raises
    ------
    UserError
        If a user's own file cannot be read.
    """
    if not isinstance(plugin.entry, type):
        return code.of_module(plugin.entry.module, plugin.entry.attr)
    try:
        return code.of_file(Path(plugin.source))
    except OSError as error:
        raise UserError(f"plug-in file {plugin.source!r} cannot be read: {cause(error)}") from error


def read_ahead(name: str, files: Iterable[str]) -> None:
    """Read the code of a method without running it, as it is now: processes that are forked from this one know it."""
    with suppress(OSError):  # a file that cannot be read is reported where it is needed
        for file in files:
            code.of_file(Path(file))
    if (plugin := installed("algorithms").get(name)) is not None:
        code_digest.cache_clear()
        code_digest(plugin)


@cache
def code_digest(plugin: Plugin) -> str:
    """SHA-256 of the code behind a plug-in, as it was when it was first asked for."""
    return code_of(plugin).digest


def declared(name: str, instance: object) -> list[Path]:
    """The files that a method declares in its attribute `reads`.

    Raises
    ------
    UserError
        If that is no list of paths.
    """
    found: list[Path] = []
    for attribute in ("reads", "code_files"):  # the latter is the old name
        said = getattr(instance, attribute, ())
        try:
            found += [Path(file) for file in said]
        except TypeError:
            said = ""
        if isinstance(said, str):
            raise UserError(f"{name}: {attribute} is no list of paths")
    return found


def method_digest(plugin: Plugin, instance: object) -> str:
    """Digest of a method: of its code, and of the files it reads (parameters that are paths, and `declared` ones).

    Raises
    ------
    UserError
        If one of them cannot be read.
    """
    files = {f"{key}={path}": path for key, path in parameters.paths_of(instance).items()}
    files |= {str(path): path for path in declared(plugin.name, instance)}
    if not files:
        return code_digest(plugin)
    digest = sha256(code_digest(plugin).encode())
    for said, file in files.items():
        try:
            digest.update(bytes.fromhex(digest_content(file)))
        except OSError as error:
            raise UserError(f"{plugin.name}: {said!r} cannot be read: {cause(error)}") from error
        except NotPlain as error:
            raise UserError(f"{plugin.name}: {said!r} cannot be read: {error}") from error
    return digest.hexdigest()


def reads_files(instance: object) -> bool:
    """May a method read files of its own for a scene?"""
    return callable(getattr(instance, "reads_for", None))


def scene_files(instance: object, scene: Scene) -> str:
    """Digest of the files that a method reads for one scene (`Algorithm.reads_for`); empty if there are none.

    Raises
    ------
    UserError
        If one of them cannot be read.
    """
    digest, found = sha256(), [Path(file) for file in instance.reads_for(scene)] if reads_files(instance) else []  # type: ignore[attr-defined]
    for file in found:
        try:
            digest.update(f"{file}\0{digest_content(file)}\0".encode())
        except OSError as error:
            raise UserError(f"{file} cannot be read: {cause(error)}") from error
        except NotPlain as error:
            raise UserError(f"{file} cannot be read: {error}") from error
    return digest.hexdigest() if found else ""


def kernel_cache() -> Path:
    """The folder of compiled kernels: another one for each state of the code of all installed methods with kernels.

    It is there, and can be written to (`matbench.plans.kernels.place`).

    numba notices a change of the file in which a kernel stands, by time and size, but not of other files whose kernels
    it calls. Therefore any change of what the code does leads to another folder. A changed comment does not.
    """
    every = [code_of(plugin) for _, plugin in sorted(installed("algorithms").items())]
    digests = [one.digest for one in every if "numba" in one.parts]
    return kernels.place(sha256(" ".join(digests).encode()).hexdigest()[:16])


def built_in_algorithms() -> list[str]:
    """The built-in methods without required parameters."""
    built_in = [p for p in installed("algorithms").values() if p.source == OWN]
    return [p.name for p in built_in if not parameters.required(p.load())]


def default_algorithms() -> list[str]:
    """Those of them that run where no method is named: all that do not ask to be named (`Algorithm`, `by_default`)."""
    return [name for name in built_in_algorithms() if getattr(installed("algorithms")[name].load(), "by_default", True)]


def groups(algorithm: str) -> dict[str, str]:
    """Parameter -> its group, for an installed method; empty for others, because code that a run names is not run."""
    plugin = installed("algorithms").get(algorithm)
    try:
        known = {} if plugin is None else parameters.parameters(plugin.load())
    except UserError:
        return {}
    return {name: one.group for name, one in known.items() if one.group}
