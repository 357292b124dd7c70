"""What compiling all methods costs: in a fresh process without any cached kernel, against a budget of its own."""

import tempfile
from collections.abc import Mapping
from pathlib import Path

from attrs import evolve, frozen

from matbench.bench.measuring import Tree, run_program

BUDGET = 1.5
"""How many times as long as stored compiling may take; a median of three is taken where the first is beyond it."""


@frozen
class Compilation:
    """Compiling every method, one after the other.

    Parameters
    ----------
    seconds
        Method -> processor seconds for what no method before it had compiled.
    reference
        Processor seconds of compiling the frozen reference's inner loop, in the same process.
    digest
        Of the reference workload.
    """

    seconds: Mapping[str, float]
    reference: float
    digest: str

    @property
    def ratio(self) -> float:
        """Compiling everything, in units of compiling the reference."""
        return sum(self.seconds.values()) / self.reference


def compile_all(tree: Tree) -> Compilation:
    """Compile in a fresh process.

    Raises
    ------
    UserError
        If a method cannot be compiled.
    """
    with tempfile.TemporaryDirectory(prefix="matbench-kernels-") as place:
        found = run_program(evolve(tree, kernels=Path(place)), "compiling")
    return Compilation(found["seconds"], found["reference"], found["digest"])
