"""The built-in methods.

Imports the basic modules and `files`; the harness never imports it, but finds it by entry points.
"""
