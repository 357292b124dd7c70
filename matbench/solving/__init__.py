"""How cells are solved: in processes of their own, here or on a cluster.

Imports `runs`, `scenes`, `recording` and what lies below them.
"""
