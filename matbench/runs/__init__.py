"""What has been done: the run folder, who works on it, what is left.

Imports the basic modules, `files`, `measures` and `plans`.
"""
