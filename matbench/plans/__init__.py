"""What is to be done: plug-ins found, requests read, cells planned.

Imports the basic modules and `files`.
"""
