"""The web page of one daemon or of a fleet: a map, the link's last minutes, topics.

This package speaks to daemons over their bus and control sockets, or to gateways over Zenoh. It
changes nothing but policies, and these only where that is allowed. Needs the extra `web`.
"""

from sdrlinkd.web.fleet_feed import follow_fleet
from sdrlinkd.web.floor_plan import FloorPlan, read_floor_plan
from sdrlinkd.web.following import follow_daemons
from sdrlinkd.web.server import Options, serve
from sdrlinkd.web.world import World

__all__ = [
    "FloorPlan",
    "Options",
    "World",
    "follow_daemons",
    "follow_fleet",
    "read_floor_plan",
    "serve",
]
