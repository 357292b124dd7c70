"""Drawing with matplotlib in one look, whatever settings its user has.

Settings come from a ``matplotlibrc``, from MPLBACKEND, or from the script or notebook that calls the harness. None of
them reaches a figure that is drawn and saved within `style`.
"""

import logging
import os
import sys
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np

from matbench.errors import UserError, failure


@contextmanager
def style(look: Mapping[str, object] = {}) -> Iterator[None]:
    """Within the block, figures have matplotlib's own default look, changed by `look`; as a decorator, too.

    Figures are both made and saved within such a block, since some settings count when a figure is saved. They are
    made as ``Figure(...)``, without ``pyplot``: so they need no backend, and nothing of them stays in memory.
    """
    matplotlib = load()
    from matplotlib import MatplotlibDeprecationWarning

    # the backend is the user's, for figures of their own
    defaults = {key: value for key, value in dict.items(matplotlib.rcParamsDefault) if key != "backend"}
    with _undisturbed(), matplotlib.rc_context():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MatplotlibDeprecationWarning)  # of settings that nobody has made
            matplotlib.rcParams.update({**defaults, **look})
        yield


def load() -> Any:
    """The module ``matplotlib``; it is imported without a word about its user's folders and settings.

    Raises
    ------
    UserError
        If it cannot be imported, as with a matplotlibrc that is no text.
    """
    with _undisturbed():
        try:
            return _imported()
        except Exception:  # MPLBACKEND may name no backend: none is needed
            before = os.environ.pop("MPLBACKEND", None)
            for half in [name for name in sys.modules if name.partition(".")[0] == "matplotlib"]:
                del sys.modules[half]  # else the second import would find these, and fail
            try:
                return _imported()
            except Exception as error:
                raise UserError(f"matplotlib cannot be imported with its settings: {failure(error)}") from error
            finally:
                if before is not None:
                    os.environ["MPLBACKEND"] = before


def _imported() -> Any:
    import matplotlib

    return matplotlib


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Keep matplotlib from telling what it has not found, and NumPy from raising where it does so: it draws anyway."""
    log = logging.getLogger("matplotlib")
    before = log.level
    log.setLevel(logging.ERROR)
    try:
        with np.errstate(divide="warn", over="warn", under="ignore", invalid="warn"):  # as NumPy is by itself
            yield
    finally:
        log.setLevel(before)
