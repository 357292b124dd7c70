"""matbench: evaluation and benchmarking of multi-baseline stereo."""

from matbench._version import __version__

__all__ = ["__version__"]
