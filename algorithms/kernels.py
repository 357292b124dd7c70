"""How the methods' inner loops are compiled."""

from typing import Any

# first: it says what is wrong with numba's settings, and lets kernels that are defined from here on do without a cache
from matbench.plans import kernel_cache  # noqa: F401

# isort: split
import numba
from numba import njit
from numba.extending import intrinsic

# the flags let sums vectorise and keep NaN and infinity honest; x / 0 is what it is to NumPy, as a loop
# that may raise does not vectorise; no kernel is a callback of C
OPTIONS: dict[str, Any] = {
    "nogil": True,
    "cache": True,
    "error_model": "numpy",
    "fastmath": {"contract", "reassoc", "nsz"},
    "no_cfunc_wrapper": True,
}
INNER = OPTIONS | {"no_cpython_wrapper": True}

# a loop that Python calls, without the interpreter's lock
kernel = njit(**OPTIONS)
# one that only other loops call: without an entry from Python it compiles sooner
helper = njit(**INNER)
# the same for one with many arguments, whose handing over takes time: it becomes part of the loop that calls it
inlined = njit(**(INNER | {"forceinline": True}))
# and for sums whose last bit matters: they are added up as written, and every product is rounded on its own
literal = njit(**(INNER | {"fastmath": False}))


@helper
def fill(value, row):  # type: ignore[no-untyped-def]
    """row = value: a slice assigned to takes seconds to compile."""
    for x in range(row.size):
        row[x] = value


@helper
def add(values, row):  # type: ignore[no-untyped-def]
    """row += values."""
    for x in range(row.size):
        row[x] += values[x]


def _popcount(_: Any, word: Any) -> Any:
    def count(_: Any, builder: Any, __: Any, arguments: Any) -> Any:
        return builder.ctpop(arguments[0])

    return word(word), count


# how many bits of a word are set: the processor's own instruction where it has one
popcount: Any = intrinsic(_popcount)
_config: Any = numba.config
if _config.DISABLE_JIT:  # kernels are plain Python then

    def popcount(word: Any) -> int:
        return int(word).bit_count()
