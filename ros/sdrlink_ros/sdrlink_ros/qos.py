"""The QoS of the bridge's subscriptions and publishers."""

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

TAKEN_DEPTH = 100
"""Messages of a topic that wait while the bridge is busy; the daemon decides which are too old."""
RELIABLE_DEPTH = 100
"""A burst of the radio brings many messages at once."""
BEST_EFFORT_DEPTH = 10


def subscription(is_reliable: bool, is_latched: bool) -> QoSProfile:
    """QoS that every publisher of a topic matches: reliable or latched only if all of them are."""
    return _profile(is_reliable, is_latched, TAKEN_DEPTH)


def publisher(is_latched: bool, is_best_effort: bool, kept: int) -> QoSProfile:
    """QoS of a publisher for messages from the air: reliable, and latched as at the source.

    Deadline, liveliness and lifespan of the source are not imitated: a radio cannot promise them.
    """
    depth = BEST_EFFORT_DEPTH if is_best_effort else RELIABLE_DEPTH
    return _profile(True, is_latched, max(1, kept) if is_latched else depth)


def _profile(is_reliable: bool, is_latched: bool, depth: int) -> QoSProfile:
    reliability, durability = ReliabilityPolicy, DurabilityPolicy
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=reliability.RELIABLE if is_reliable else reliability.BEST_EFFORT,
        durability=durability.TRANSIENT_LOCAL if is_latched else durability.VOLATILE,
    )
