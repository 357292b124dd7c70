"""Files on disk and over the network, read and written with care.

Imports the basic modules only.
"""
