"""For programs on the robot: publish to other robots and receive from them. Needs only pyzmq.

with Publisher() as out:
    out.send("/robot_1/odom", cdr_bytes)

with Subscriber("/rx_robot_2/odom") as heard:
    for message in heard:
        print(message.source, message.age_us, len(message.payload))

with Publisher() as out:
    out.send("/robot_1/cmd_vel", cdr_bytes, receipt=True)
    print(out.receipt(timeout_s=5.0))

`send` raises MessageRefusedError for a message that the daemon does not accept. In a callback of a
ROS node, use `send(..., wait=False)`, which never blocks and returns False without a daemon. Runs
on Python 3.10 and newer.
"""

from typing import TYPE_CHECKING

from sdrlinkd.client.announced import (
    LEAST_RATE_HZ,
    MAX_KEY_BYTES,
    MOST_RATE_HZ,
    QOS,
    check_wishes,
    too_large,
    too_short,
    unknown_topic,
    wrong_type,
)
from sdrlinkd.client.awaited import DAEMON_GONE
from sdrlinkd.client.control import ControlClient, RefusedError
from sdrlinkd.client.errors import (
    UNKNOWN_TOPIC,
    EnvelopeMismatchError,
    MessageRefusedError,
    NoDaemonError,
    no_daemon,
)
from sdrlinkd.client.flatmap import pack_map, unpack
from sdrlinkd.client.messages import (
    ACK_PREFIX,
    ENVELOPE_VERSION,
    LATE_PREFIX,
    RECEIPT_PREFIX,
    SYNC_PREFIX,
    Message,
    Receipt,
)
from sdrlinkd.client.names import MessageName
from sdrlinkd.client.paths import (
    CONTROL_SOCKET,
    IN_PUB_SOCKET,
    IN_SOCKET,
    OUT_SOCKET,
    endpoint,
    is_open,
    runtime_dir,
)
from sdrlinkd.client.publisher import Publisher
from sdrlinkd.client.subscriber import Subscriber

if TYPE_CHECKING:
    from sdrlinkd.client.async_publisher import AsyncPublisher
    from sdrlinkd.client.async_subscriber import AsyncSubscriber

__all__ = [
    "ACK_PREFIX",
    "CONTROL_SOCKET",
    "DAEMON_GONE",
    "ENVELOPE_VERSION",
    "IN_PUB_SOCKET",
    "IN_SOCKET",
    "LATE_PREFIX",
    "LEAST_RATE_HZ",
    "MAX_KEY_BYTES",
    "MOST_RATE_HZ",
    "OUT_SOCKET",
    "QOS",
    "RECEIPT_PREFIX",
    "SYNC_PREFIX",
    "UNKNOWN_TOPIC",
    "AsyncPublisher",
    "AsyncSubscriber",
    "ControlClient",
    "EnvelopeMismatchError",
    "Message",
    "MessageName",
    "MessageRefusedError",
    "NoDaemonError",
    "Publisher",
    "Receipt",
    "RefusedError",
    "Subscriber",
    "check_wishes",
    "endpoint",
    "is_open",
    "no_daemon",
    "pack_map",
    "runtime_dir",
    "too_large",
    "too_short",
    "unknown_topic",
    "unpack",
    "wrong_type",
]


def __getattr__(name: str) -> object:
    """Import an asynchronous client on first use (PEP 562): asyncio is slow to load."""
    if name == "AsyncPublisher":
        from sdrlinkd.client.async_publisher import AsyncPublisher

        return AsyncPublisher
    if name == "AsyncSubscriber":
        from sdrlinkd.client.async_subscriber import AsyncSubscriber

        return AsyncSubscriber
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
