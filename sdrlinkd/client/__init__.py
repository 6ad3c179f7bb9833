"""For programs on the robot: publish to other robots, and hear them. Needs pyzmq only.

with Publisher() as out:
    out.send("/robot_1/odom", cdr_bytes)

with Subscriber("/rx_robot_2/odom") as heard:
    for message in heard:
        print(message.source, message.age_us, len(message.payload))

with Publisher() as out:
    out.send("/robot_1/cmd_vel", cdr_bytes, receipt=True)
    print(out.receipt(timeout_s=5.0))
"""

from sdrlinkd.client.aio import AsyncPublisher, AsyncSubscriber
from sdrlinkd.client.blocking import NoDaemonError, Publisher, Subscriber, no_daemon
from sdrlinkd.client.control import ControlClient, RefusedError
from sdrlinkd.client.flatmap import pack_map, unpack
from sdrlinkd.client.messages import (
    ACK_PREFIX,
    ENVELOPE_VERSION,
    RECEIPT_PREFIX,
    SYNC_PREFIX,
    EnvelopeMismatchError,
    Message,
    Receipt,
)
from sdrlinkd.client.paths import (
    CONTROL_SOCKET,
    IN_PUB_SOCKET,
    IN_SOCKET,
    OUT_SOCKET,
    endpoint,
    runtime_dir,
)

__all__ = [
    "ACK_PREFIX",
    "CONTROL_SOCKET",
    "ENVELOPE_VERSION",
    "IN_PUB_SOCKET",
    "IN_SOCKET",
    "OUT_SOCKET",
    "RECEIPT_PREFIX",
    "SYNC_PREFIX",
    "AsyncPublisher",
    "AsyncSubscriber",
    "ControlClient",
    "EnvelopeMismatchError",
    "Message",
    "NoDaemonError",
    "Publisher",
    "Receipt",
    "RefusedError",
    "Subscriber",
    "endpoint",
    "no_daemon",
    "pack_map",
    "runtime_dir",
    "unpack",
]
