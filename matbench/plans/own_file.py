"""Importing a user's own file (a plug-in), together with the files beside it.

In a plug-in, ``import helper`` means the file beside it, as in a script. No other module sees that file. The plug-in
and its helpers become modules of an artificial package, and only the imports of these modules look there first. So
two folders may each have a ``helper.py``. The package's name contains a digest of the code: changed code is another
package, and is imported again.
"""

import builtins
import importlib
import importlib.util
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from hashlib import sha256
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

from matbench import code
from matbench.errors import UserError, failure
from matbench.plans import kernels

_PREFIX = "matbench_plugin_"


def import_file(path: Path) -> ModuleType:
    """Import a plug-in as its code is now.

    Raises
    ------
    UserError
        If the file cannot be read, is no Python file, or fails to import, whatever the reason.
    """
    if path.suffix != ".py":
        raise UserError(f"plug-in file {str(path)!r} is not a Python file: its name must end in .py")
    path = path.absolute()
    try:
        behind = code.of_file(path)
    except OSError as error:
        raise UserError(f"plug-in file {str(path)!r} cannot be read: {error.strerror}") from error
    package = _PREFIX + sha256(f"{path}\0{behind.digest}".encode()).hexdigest()[:16]
    name = f"{package}.{path.stem.replace('.', '_')}"
    if name in sys.modules:
        return sys.modules[name]
    if _Finder not in sys.meta_path:
        sys.meta_path.insert(0, _Finder)
    importlib.invalidate_caches()
    if behind.parts.get("numba", code.NOT_THERE) != code.NOT_THERE:
        importlib.import_module("numba")  # now: `_kernels_apart` can set its cache folder only if it is imported
    sys.modules[package] = _made_up(package, path.parent)
    try:
        return _imported(name, path)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # sys.exit included
        # the next try must not find helpers that were imported by this one
        for one in [one for one in sys.modules if one.partition(".")[0] == package]:
            del sys.modules[one]
        raise UserError(f"plug-in file {str(path)!r}: {failure(error)}") from error


def _made_up(name: str, folder: Path) -> ModuleType:
    package = ModuleType(name)
    package.__path__ = [str(folder)]
    package.__spec__ = ModuleSpec(name, None, is_package=True)
    return package


def _imported(name: str, path: Path) -> ModuleType:
    """The module of a file, which may have a name that no import statement could write."""
    spec = importlib.util.spec_from_file_location(name, path, loader=_Loader(name, str(path)))
    assert spec is not None, "it has a loader"  # noqa: S101
    assert spec.loader is not None, "it is this one"  # noqa: S101
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


class _Loader(SourceFileLoader):
    """Runs a module that belongs to a plug-in."""

    def get_code(self, fullname: str) -> CodeType:
        """Compile the source each time: Python's compiled file misses a second edit within the same second."""
        path = self.get_filename(fullname)
        compiled: CodeType = self.source_to_code(self.get_data(path), path)
        return compiled

    def exec_module(self, module: ModuleType) -> None:
        """Run the module so that its import statements, also those in functions, look beside it first."""
        # Python looks up `__import__` in the builtins of the importing module, at every import statement
        package = module.__name__.partition(".")[0]
        own = {**vars(builtins), "__import__": _Import(package, module.__name__)}
        module.__dict__["__builtins__"] = own
        with _kernels_apart(package):
            super().exec_module(module)


class _Finder:
    """Finds the modules of plug-ins, and has `_Loader` run them."""

    @classmethod
    def find_spec(cls, name: str, path: Sequence[str] | None = None, _: Any = None) -> ModuleSpec | None:
        """The module where Python would find it; None for modules of no plug-in."""
        if path is None or not name.startswith(_PREFIX):
            return None
        spec = PathFinder.find_spec(name, path)
        if spec is not None and type(spec.loader) is SourceFileLoader:
            spec.loader = _Loader(spec.loader.name, spec.loader.path)
        return spec


class _Import:
    """What ``import`` does in a module of a plug-in."""

    def __init__(self, package: str, module: str) -> None:
        self.package, self.module = package, module

    def __call__(
        self,
        name: str,
        globals: Mapping[str, object] | None = None,
        locals: Mapping[str, object] | None = None,
        fromlist: Sequence[str] | None = (),
        level: int = 0,
    ) -> ModuleType:
        top = name.partition(".")[0]
        inside = f"{self.package}.{top}"
        folder = Path(sys.modules[self.package].__path__[0])
        # Python's own way for a relative import, and for all that does not lie beside; a file never imports itself:
        # ``import numpy`` in numpy.py means the library
        if level or self.module == inside or not code.lies_beside(folder, top):
            return builtins.__import__(name, globals, locals, fromlist or (), level)
        if fromlist:
            return builtins.__import__(f"{self.package}.{name}", globals, locals, fromlist, 0)
        importlib.import_module(f"{self.package}.{name}")
        return sys.modules[inside]


@contextmanager
def _kernels_apart(package: str) -> Iterator[None]:
    """Give numba a cache folder of its own for each state of a plug-in's code.

    numba notices a change of the file in which a kernel stands, but not of other files whose kernels it calls.
    """
    config: Any = getattr(sys.modules.get("numba"), "config", None)
    if config is None:
        yield
        return
    before = config.CACHE_DIR
    with suppress(UserError):  # there is no home folder: numba finds a place, or compiles them anew
        config.CACHE_DIR = str(Path(before or kernels.home()) / package)
    try:
        yield
    finally:
        config.CACHE_DIR = before
