"""How the methods' inner loops are compiled."""

from typing import Any

from numba import njit

# the flags let sums vectorise and keep NaN and infinity honest; no kernel is a callback of C
OPTIONS: dict[str, Any] = {
    "nogil": True,
    "cache": True,
    "fastmath": {"contract", "reassoc", "nsz"},
    "no_cfunc_wrapper": True,
}
INNER = OPTIONS | {"no_cpython_wrapper": True}

# a loop that Python calls, without the interpreter's lock
kernel = njit(**OPTIONS)
# one that only other loops call: without an entry from Python it compiles sooner
helper = njit(**INNER)
