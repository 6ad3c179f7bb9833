"""What commands show, and how it is laid out. Every figure comes from the reports."""

from sdrlinkd.cli.screens.daemons import daemons_table
from sdrlinkd.cli.screens.figures import clock_state, duration, milliseconds, size, sparkline
from sdrlinkd.cli.screens.latency import latency_screen
from sdrlinkd.cli.screens.status import StatusScreen

__all__ = [
    "StatusScreen",
    "clock_state",
    "daemons_table",
    "duration",
    "latency_screen",
    "milliseconds",
    "size",
    "sparkline",
]
