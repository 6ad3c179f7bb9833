"""Measurements of our link next to its peers; each runs as `python -m benchmarks.NAME`."""
