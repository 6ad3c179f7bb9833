"""One end of ROS 2 with Fast DDS: rclpy from wheels. Runs in its own environment.

Messages are std_msgs/UInt8MultiArray, serialised here, so that rclpy's slow conversion from a list
of numbers to bytes is not measured.
"""

import importlib
import os
import struct
import tempfile
import time
from typing import Any

from benchmarks.peers.pound.job import CONTACT_S, Hear, Job, NoContactError

CDR = struct.Struct("<4sIII")
"""Encapsulation; an empty layout: dimensions, data_offset; then the number of bytes that follow."""
LITTLE_ENDIAN = b"\0\1\0\0"
DEPTH = 10
DOMAIN = "77"


class FastDds:
    """A node with its publishers and subscriptions, spun in `run`."""

    def __init__(self, job: Job, reliability: str, hear: Hear) -> None:
        os.environ |= {
            "ROS_DOMAIN_ID": DOMAIN,
            # No multicast, which a relay would not forward.
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "ROS_STATIC_PEERS": job.there,
            # Both ends share this machine's memory, which two robots would not.
            "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4",
            "ROS_LOG_DIR": tempfile.gettempdir(),
        }
        # Imported here: it is not installed in the type checker's environment.
        self._rclpy: Any = importlib.import_module("rclpy")
        qos: Any = importlib.import_module("rclpy.qos")
        kind: Any = importlib.import_module("std_msgs.msg").UInt8MultiArray
        self._rclpy.init()
        self._node = self._rclpy.create_node(f"pound_{job.side}")
        self._hear = hear
        profile = qos.QoSProfile(
            history=qos.HistoryPolicy.KEEP_LAST,
            depth=DEPTH,
            reliability=getattr(qos.ReliabilityPolicy, reliability.upper()),
        )
        self._publishers = {
            topic.number: self._node.create_publisher(kind, f"pound/{topic.name}", profile)
            for topic in job.out
        }
        self._subscriptions = [
            self._node.create_subscription(
                kind, f"pound/{topic.name}", self._come_in, profile, raw=True
            )
            for topic in job.into
        ]
        executors: Any = importlib.import_module("rclpy.executors")
        self._executor = executors.SingleThreadedExecutor()
        self._executor.add_node(self._node)

    def meet(self) -> None:
        """Wait until all publishers and subscriptions are matched."""
        deadline = time.monotonic() + CONTACT_S
        while not (
            all(one.get_subscription_count() for one in self._publishers.values())
            and all(self._node.count_publishers(one.topic_name) for one in self._subscriptions)
        ):
            if time.monotonic() > deadline:
                raise NoContactError(f"DDS discovery was not done within {CONTACT_S:.0f} s")
            self._executor.spin_once(0.02)
        # The readers and writers of both ends discover each other one after the other.
        self.run(time.monotonic() + 0.5)

    def send(self, topic: int, message: bytes) -> None:
        """Publish a message on its topic."""
        self._publishers[topic].publish(CDR.pack(LITTLE_ENDIAN, 0, 0, len(message)) + message)

    def run(self, until: float) -> None:
        """Spin until that time, and hand over what has arrived."""
        while (left := until - time.monotonic()) > 0:
            self._executor.spin_once(left)

    def close(self) -> None:
        """Do nothing: the process ends soon, and destroying entities takes very long."""

    def _come_in(self, data: bytes) -> None:
        now = time.monotonic()
        size = CDR.unpack_from(data)[3]
        self._hear(data[CDR.size : CDR.size + size], now)
