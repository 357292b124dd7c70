"""The commands of `matbench`, one module each. A module is imported when its command is typed: `--help` stays quick.

Imports everything.
"""
