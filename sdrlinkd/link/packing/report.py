"""The report on what was composed."""

from typing import NamedTuple


class ComposerReport(NamedTuple):
    """Counts of what was composed since the start."""

    entries: int
    pdus: int
    starved: list[int]
    """Topic ids that had to wait for a free entry id."""
