"""A request as people write it: a TOML file of algorithms and scenes, and seeds."""

import operator
from pathlib import Path

from matbench.errors import UserError, unknown
from matbench.files.toml import read_toml

LARGEST_SEED = 2**64 - 1


def read_request(path: Path) -> tuple[list[str], list[str] | None]:
    """Selectors of algorithms and scenes from a TOML file; None where it names no scenes.

    Raises
    ------
    UserError
        If the file is missing, is no TOML, or holds something else than the two lists.
    """
    found = read_toml(path, "request")
    for key, value in found.items():
        if key not in ("algorithms", "scenes"):
            raise unknown(f"key in {path}", key, ("algorithms", "scenes"))
        if not (isinstance(value, list) and value and all(isinstance(one, str) for one in value)):
            raise UserError(f"{path}: {key} is {value!r}, not a list of texts such as {key} = ['...']")
    if "algorithms" not in found:
        raise UserError(f"{path} names no algorithms: write algorithms = ['materiality[pairs=all,consecutive]']")
    return found["algorithms"], found.get("scenes")


def seeds_of(seed: object) -> list[int]:
    """The seeds of a request as a list, each once.

    Raises
    ------
    UserError
        If one is no whole number from 0.
    """
    given = list(seed) if isinstance(seed, list | tuple | range) else [seed]
    try:
        # `index` takes numpy's whole numbers, too, but no 1.0
        found = [operator.index(one) for one in given if not isinstance(one, bool)]  # type: ignore[arg-type]
    except TypeError:
        found = []
    if len(found) != len(given) or not found or min(found) < 0 or max(found) > LARGEST_SEED:
        raise UserError(f"seed {seed!r} is not one or several whole numbers from 0 to {LARGEST_SEED}")
    return list(dict.fromkeys(found))
