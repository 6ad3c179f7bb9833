"""Measurements beside peers; each is run as `python -m benchmarks.NAME`."""
