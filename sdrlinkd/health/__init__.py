"""The health of a daemon and its link in plain sentences: a verdict, and changes for the log.

This package keeps the history that both need; its only input is snapshots.
"""

from sdrlinkd.health.health import Health
from sdrlinkd.health.story import Level, Line
from sdrlinkd.health.words import first_line, line_told, span

__all__ = ["Health", "Level", "Line", "first_line", "line_told", "span"]
