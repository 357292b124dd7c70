"""What follows from stored cells: scores, repeats, ablations, curves, archives.

Imports `runs`, `scenes`, `recording` and what lies below them.
"""
