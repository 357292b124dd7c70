"""Importing a user's own file (a plug-in), together with the files beside it.

In a plug-in, ``import helper`` means the file beside it, as in a script. No other module sees that file. The plug-in
and its helpers become modules of an artificial package, and only the imports of these modules look there first. So
two folders may each have a ``helper.py``. The package's name contains a digest of the code: changed code is another
package, and is imported again.

A method may start processes, as by `multiprocessing`. These find its classes and functions under the same names: the
package lies below this module, which every process can import, and a variable of the environment says where its files
are.
"""

import builtins
import importlib
import importlib.util
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from hashlib import sha256
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

from matbench import code
from matbench.errors import UserError, cause, failure
from matbench.plans import kernels

__path__: list[str] = []  # this module is a package, too: that of the packages of all plug-ins
_PREFIX = f"{__name__}.p"
_DIGITS = 16
_VARIABLE = "MATBENCH_PLUGIN_"  # and the digits of a package: the path of its plug-in
_files: dict[str, Path] = {}  # the packages that this process has looked at -> their plug-ins


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
    if path.exists() and not path.is_file():  # a pipe would be waited for
        raise UserError(f"plug-in file {str(path)!r} is no file")
    try:
        package = _package(path)
    except OSError as error:
        raise UserError(f"plug-in file {str(path)!r} cannot be read: {cause(error)}") from error
    # set each time: a process that solves several cells takes back what the method of one has changed
    os.environ[_VARIABLE + package.removeprefix(_PREFIX)] = str(path)
    name = f"{package}.{_stem(path)}"
    if name in sys.modules:
        return sys.modules[name]
    importlib.invalidate_caches()
    try:
        return importlib.import_module(name)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # sys.exit included
        # the next try must not find helpers that were imported by this one
        for one in [one for one in sys.modules if _package_of(one) == package]:
            del sys.modules[one]
        raise UserError(f"plug-in file {str(path)!r}: {failure(error)}") from error


def _package(path: Path) -> str:
    """The package of a plug-in as its code is now.

    Raises
    ------
    OSError
        If the file cannot be read.
    """
    behind = code.of_file(path)
    if behind.parts.get("numba", code.NOT_THERE) != code.NOT_THERE:
        # now: `_kernels_apart` can set numba's cache folder only if it is imported
        importlib.import_module("matbench.plans.kernel_cache")
    package = _PREFIX + sha256(f"{path}\0{behind.digest}".encode()).hexdigest()[:_DIGITS]
    _files[package] = path
    return package


def _package_of(module: str) -> str:
    return module[: len(_PREFIX) + _DIGITS]


def _stem(path: Path) -> str:
    return path.stem.replace(".", "_")


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
        package = _package_of(module.__name__)
        own = {**vars(builtins), "__import__": _Import(package, module.__name__)}
        module.__dict__["__builtins__"] = own
        with _kernels_apart(package):
            super().exec_module(module)


class _Finder:
    """Finds the packages of plug-ins and the modules in them, and has `_Loader` run them."""

    @classmethod
    def find_spec(cls, name: str, path: Sequence[str] | None = None, _: Any = None) -> ModuleSpec | None:
        """The package of a plug-in, or a module in it where Python would find it; None for all others."""
        if not name.startswith(_PREFIX):
            return None
        package = _package_of(name)
        file = _files.get(package) or cls._named(package)
        if file is None:
            return None
        if name == package:
            spec = ModuleSpec(name, None, is_package=True)
            spec.submodule_search_locations = [str(file.parent)]
            return spec
        if name == f"{package}.{_stem(file)}":  # a file's name may be one that no import statement could write
            return importlib.util.spec_from_file_location(name, file, loader=_Loader(name, str(file)))
        found = PathFinder.find_spec(name, path)
        if found is not None and type(found.loader) is SourceFileLoader:
            found.loader = _Loader(found.loader.name, found.loader.path)
        return found

    @staticmethod
    def _named(package: str) -> Path | None:
        """The plug-in that the environment names: another process has imported it, and this one is to work for it.

        Raises
        ------
        ImportError
            If its code has been changed since then.
        """
        said = os.environ.get(_VARIABLE + package.removeprefix(_PREFIX))
        if said is None:
            return None
        if _package(Path(said)) != package:
            raise ImportError(f"{said} is not what it was when the process began that asks for it")
        return Path(said)


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
    config.CACHE_DIR = str(Path(before, package) if before else kernels.place(package))
    try:
        yield
    finally:
        config.CACHE_DIR = before


sys.meta_path.insert(0, _Finder)
