"""`matbench bench`: timings that can be judged.

The subjects of tests/benchmarks are timed in fresh processes and compared with stored ratios or another commit.

Imports what lies below `reports`.
"""
