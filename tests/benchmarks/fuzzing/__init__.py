"""Mutators of `tests/benchmarks/fuzz.py`, one module for each format."""
