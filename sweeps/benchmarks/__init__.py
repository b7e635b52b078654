"""Benchmarks against peers in the same run: `python -m sweeps.benchmarks.NAME` from the root of a checkout."""
