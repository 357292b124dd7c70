"""Runs on disk: the run folder, who works on it, what is done and what is left.

Imports the basic modules, `files`, `measures` and `plans`.
"""
