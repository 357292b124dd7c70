"""Numbers about disparity maps and volumes: metrics, prediction, statistics.

Imports the basic modules and `files`.
"""
