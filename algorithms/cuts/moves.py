"""How long, in what order and by what library labels expand: a group of parameters."""

from importlib.util import find_spec
from typing import Any, get_args

from attrs import field, frozen, validators

from matbench.algorithms.cuts.maxflow import Flow


def _installed(_: object, attribute: Any, value: str) -> None:
    if value == "ortools" and find_spec("ortools") is None:
        raise ValueError(f"{attribute.name} is ortools, which is not installed: pip install 'matbench-stereo[ortools]'")


@frozen
class Moves:
    """How expansion moves are made. A group of parameters.

    Parameters
    ----------
    rounds
        How often every label expands, at most; it ends when no label's expansion lowers the energy.
    order
        0: labels expand from far to near; else in a random order, the same for the same number. It changes the
        answer by tenths of a per cent.
    flow
        What finds the maximal flows: ``trees`` (search trees, compiled), ``scipy``, or ``ortools`` if it is
        installed (the extra of that name). The answer is the same by each.
    """

    rounds: int = field(default=3, validator=validators.ge(1))
    order: int = field(default=0, validator=validators.ge(0))
    flow: Flow = field(default="trees", validator=[validators.in_(get_args(Flow)), _installed])
