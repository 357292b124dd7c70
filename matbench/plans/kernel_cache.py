"""How numba keeps compiled kernels: importing this module makes it forgive a cache that is damaged or cannot be used.

numba by itself refuses to define a kernel where none can be kept, and fails at every call of one whose files are
damaged or cannot be written. With this module it compiles such a kernel anew. Whoever defines kernels imports it first.
"""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import Any

from matbench.errors import UserError

try:
    import numba
except ValueError as error:  # numba says what is wrong, but not where
    _set = os.environ.get("NUMBA_NUM_THREADS", "")
    raise UserError(f"NUMBA_NUM_THREADS is {_set!r}: it must be a whole number above 0") from error
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.dispatcher import Dispatcher

from matbench.files.own_folders import cache_folder

_MARK = b"matbench"  # begins what stands behind a file's content
_SEAL = len(_MARK) + sha256().digest_size


class KernelCache(FunctionCache):
    """The cached machine code of one kernel; whatever is wrong with it, the kernel is compiled anew."""

    _cache_file: "_SealedFiles"

    def __init__(self, function: Callable[..., object]) -> None:
        super().__init__(function)
        stamp = self._impl.locator.get_source_stamp()
        self._cache_file = _SealedFiles(self._cache_path, self._impl.filename_base, stamp)

    def load_overload(self, signature: Any, target: Any) -> Any:
        """The compiled kernel for these types; None if there is none that can be used."""
        try:
            return super().load_overload(signature, target)
        except Exception:  # whatever pickle and LLVM make of what is damaged
            self._cache_file.remove()
            return None

    def signatures(self, target: Any) -> list[Any]:
        """The types for which machine code of this kernel is kept, for this processor and this code."""
        codegen = target.codegen()
        return [key[0] for key in self._cache_file._load_index() if key == self._index_key(key[0], codegen)]

    def save_overload(self, signature: Any, compiled: Any) -> None:
        """Keep a compiled kernel, if the file system takes it."""
        try:
            super().save_overload(signature, compiled)
        except Exception:  # the disk is full, or what lies there is damaged and cannot be removed
            self.disable()


class _SealedFiles(IndexDataCacheFile):
    """numba's files of one kernel, each with its digest behind it: machine code that has changed must not run.

    The content is pickles, whose readers stop where a pickle ends. So numba itself reads these files, too, and files
    without a seal, which it has written itself, are read here.
    """

    @contextmanager
    def _open_for_write(self, path: str) -> Iterator[BytesIO]:
        with super()._open_for_write(path) as file:
            held = BytesIO()
            yield held
            file.write(held.getvalue() + _MARK + sha256(held.getvalue()).digest())

    def _load_index(self) -> Any:
        _check(self._index_path)
        return super()._load_index()

    def _load_data(self, name: str) -> Any:
        _check(self._data_path(name))
        return super()._load_data(name)

    def remove(self) -> None:
        """Remove the list of what is kept of this kernel; what is kept is then written anew."""
        with suppress(OSError):
            Path(self._index_path).unlink()


def _check(path: str) -> None:
    """Raise ValueError if a file is not what was sealed."""
    with suppress(FileNotFoundError):
        whole = Path(path).read_bytes()
        content, seal = whole[:-_SEAL], whole[-_SEAL:]
        if seal.startswith(_MARK) and seal != _MARK + sha256(content).digest():
            raise ValueError(f"{path} is damaged")


def _enable_caching(dispatcher: Any) -> None:
    """Keep a kernel where that is possible: numba would raise where it is not."""
    config: Any = numba.config
    if not config.CACHE_DIR:
        try:
            cache_folder()
        except UserError:  # numba would make a folder called "~" where it is
            return
    with suppress(OSError, RuntimeError):
        dispatcher._cache = KernelCache(dispatcher.py_func)


_dispatcher: Any = Dispatcher
_dispatcher.enable_caching = _enable_caching
