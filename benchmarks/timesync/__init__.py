"""Compares clock filters on the same streams of stamps."""
