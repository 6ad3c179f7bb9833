"""What the bridge says of itself, on the topic /sdrlink/bridge."""

import msgspec


class BridgeReport(msgspec.Struct, frozen=True, kw_only=True):
    """The bridge at one moment; counts are from its start."""

    has_daemon: bool
    """Whether the daemon answers."""
    topics: int
    """Topics of other robots that Foxglove is shown."""
    passed: int
    """Messages passed on, to all clients together."""
    not_shown: int
    """Messages of topics beyond the most that are shown."""
    unreadable: int
    """Messages that should tell a robot's place and are not of their type."""
    slow: int
    """How often clients were found too slow, and lost their oldest messages; at most twice a minute
    is told."""
    clients_refused: int
    """Connections that were refused: without the token, from other pages or other accounts."""
    commands_sent: int
    """Commands from Foxglove that the daemon took."""
    commands_refused: int
    """Commands from Foxglove that the bridge or the daemon refused."""
    commands_outdated: int
    """Commands dropped, as a newer one of their topic came before they could be sent."""
