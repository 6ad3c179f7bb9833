"""A bridge as a user writes it in forty lines: an executor, a callback, and the client.

Runs in an environment with rclpy. Arguments: the daemon's runtime directory.
"""

import importlib
import sys
from typing import Any

from sdrlinkd.client import ControlClient, Publisher

TOPIC, TYPE = "/odom", "nav_msgs/msg/Odometry"


def main() -> None:
    """Take /odom to the radio until it is stopped."""
    # Imported by name: only this environment has them.
    rclpy: Any = importlib.import_module("rclpy")
    qos: Any = importlib.import_module("rclpy.qos")
    messages: Any = importlib.import_module("nav_msgs.msg")
    with ControlClient(sys.argv[1]) as control:
        control.ask("declare", {"name": TOPIC, "type": TYPE})
    rclpy.init()
    node = rclpy.create_node("plain_bridge")
    with Publisher(sys.argv[1]) as out:
        out.wait_for_daemon()

        def forward(cdr: bytes) -> None:
            out.send(TOPIC, cdr, wait=False)

        profile = qos.QoSProfile(depth=100, reliability=qos.ReliabilityPolicy.BEST_AVAILABLE)
        node.create_subscription(messages.Odometry, TOPIC, forward, profile, raw=True)
        rclpy.spin(node)


if __name__ == "__main__":
    main()
