"""Checks whether this machine can run a node."""
