"""How a daemon and its link fare, in plain words: a verdict on a snapshot, and what has changed
since the one before. Owns the memory that both need; reads snapshots and nothing else.
"""

from sdrlinkd.health.health import Health
from sdrlinkd.health.story import Level, Line

__all__ = ["Health", "Level", "Line"]
