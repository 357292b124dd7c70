"""How long compiling all methods takes, in a fresh process without cached kernels. It has a budget of its own."""

from collections.abc import Mapping

from attrs import evolve, frozen

from matbench.bench.measuring import Tree, run_program
from matbench.files.temporary import temporary_folder

BUDGET = 1.5
"""How many times the stored time compiling may take; if the first measurement is beyond it, the median of three."""


@frozen
class Compilation:
    """The time of compiling every method, one after the other.

    Parameters
    ----------
    seconds
        Method -> processor seconds for the kernels that no method before it had compiled.
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
        """Time of compiling everything, in units of compiling the reference."""
        return sum(self.seconds.values()) / self.reference


def compile_all(tree: Tree) -> Compilation:
    """Compile all methods in a fresh process, with an empty kernel cache.

    Raises
    ------
    UserError
        If a method cannot be compiled.
    """
    with temporary_folder() as place:
        found = run_program(evolve(tree, kernels=place), "compiling")
    return Compilation(found["seconds"], found["reference"], found["digest"])
