"""The layout of the commands' screens; every figure comes from the reports."""

from sdrlinkd.cli.screens.daemons import daemons_table
from sdrlinkd.cli.screens.figures import (
    bytes_rate,
    clock_state,
    duration,
    milliseconds,
    rate,
    sparkline,
)
from sdrlinkd.cli.screens.latency import latency_screen
from sdrlinkd.cli.screens.routes import routes_screen
from sdrlinkd.cli.screens.rows import failed, is_idle, robots_table
from sdrlinkd.cli.screens.status import StatusScreen, verdict
from sdrlinkd.cli.screens.team import team_screen

__all__ = [
    "StatusScreen",
    "bytes_rate",
    "clock_state",
    "daemons_table",
    "duration",
    "failed",
    "is_idle",
    "latency_screen",
    "milliseconds",
    "rate",
    "robots_table",
    "routes_screen",
    "sparkline",
    "team_screen",
    "verdict",
]
