"""Timings that can be judged: measured in fresh processes by tests/benchmarks, compared with what is stored."""
