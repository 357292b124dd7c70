"""Recordings for the rerun viewer.

Imports the basic modules, `files`, `measures` and `plans`.
"""
