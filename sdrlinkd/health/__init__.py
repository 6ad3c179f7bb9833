"""How a daemon and its link fare, in plain words: a verdict, and what has changed.

The package owns the memory that both need; it reads snapshots and nothing else.
"""

from sdrlinkd.health.health import Health
from sdrlinkd.health.story import Level, Line

__all__ = ["Health", "Level", "Line"]
