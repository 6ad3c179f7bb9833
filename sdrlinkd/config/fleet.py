"""The section `[fleet]`: what `sdrlink-gateway` does beside the daemon."""

from typing import Annotated

import msgspec
from msgspec import Meta

FLEET_NAME = r"^[A-Za-z0-9_-]{1,64}\Z"
ENDPOINT = r"^[a-z]+/\S+\Z"
"""Patterns of names of fleets, and of Zenoh's endpoints."""
FleetName = Annotated[str, Meta(pattern=FLEET_NAME)]
Endpoint = Annotated[str, Meta(pattern=ENDPOINT)]


class FleetParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How the robots that this daemon hears are joined to a fleet over Zenoh."""

    name: FleetName = "fleet"
    """Name of the fleet, the second chunk of all keys; the same at all gateways."""
    connect: list[Endpoint] = []
    """Zenoh endpoints of routers to connect to; []: tcp/localhost:7447, unless `listen` is not
    empty."""
    listen: list[Endpoint] = []
    """Zenoh endpoints to listen at; with any, this gateway is a Zenoh router itself."""
    zenoh: str = ""
    """File with more of Zenoh's own configuration (JSON5), such as `sdrlinkctl key certificates`
    writes, relative to the configuration file."""
    up: list[str] = []
    """Patterns of the topics of robots that are put on Zenoh; []: all."""
    down: list[str] = []
    """Patterns of the topics that operators may send to robots; needs certificates."""
    bridge: list[str] = []
    """Patterns of the topics that this gateway's daemon sends to its robots for robots that only
    other gateways hear, so that both are one team; needs `auto = true`, and
    certificates."""
    ros_domain: Annotated[int, Meta(ge=0, le=232)] | None = None
    """ROS domain id in which robots appear to ROS 2 nodes on rmw_zenoh; absent: in none."""
    lease_s: Annotated[float, Meta(ge=0.5, le=60)] = 1.0
    """Time in s after which another gateway takes over from one that is silent."""
