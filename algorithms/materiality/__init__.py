"""The materiality map (ICIP 2014): the surfaces of a scene as a fuzzy map over disparity space.

Equations are numbered as in docs/concepts/materiality.md.
"""

from matbench.algorithms.materiality.method import Materiality

__all__ = ["Materiality"]
