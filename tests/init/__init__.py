"""Configurations to start with."""
