"""ROS 2 nodes that load a bridge: a source, a sink, and a graph. Runs where rclpy is.

Arguments: `source HZ N` publishes odometry on /odom once somebody subscribes, `sink N` prints the
latencies in ms of messages on /robot_1/odom, and `graph N` has N publishers that never publish.
Each prints a line when it is ready, and one at its end.
"""

import importlib
import json
import sys
import threading
import time
from typing import Any

TYPE_SIZE = 724
SECOND_NS = 1_000_000_000


def main() -> None:
    """Run the part that the arguments name."""
    rclpy: Any = importlib.import_module("rclpy")
    rclpy.init()
    part, *numbers = sys.argv[1:]
    node = rclpy.create_node(part)
    run: Any = {"source": source, "sink": sink, "graph": graph}[part]
    run(rclpy, node, *map(int, numbers))


def say(what: object) -> None:
    """Print a line for the benchmark."""
    print(json.dumps(what), flush=True)


def source(_: Any, node: Any, hz: int, n: int) -> None:  # noqa: ANN401
    """Publish at a steady rate."""
    message: Any = importlib.import_module("nav_msgs.msg").Odometry()
    serialize: Any = importlib.import_module("rclpy.serialization").serialize_message
    message.header.frame_id, message.child_frame_id = "odom", "base_link"
    publisher = node.create_publisher(type(message), "/odom", 1000)
    while not publisher.get_subscription_count():
        time.sleep(0.01)
    say("ready")
    sys.stdin.readline()
    begin = time.monotonic()
    for i in range(n):
        time.sleep(max(0.0, begin + i / hz - time.monotonic()))
        stamp = message.header.stamp
        stamp.sec, stamp.nanosec = divmod(time.time_ns(), SECOND_NS)
        publisher.publish(serialize(message))
    say({"octets": len(serialize(message))})
    sys.stdin.readline()


def sink(rclpy: Any, node: Any, n: int) -> None:  # noqa: ANN401
    """Receive, and tell how old each message was."""
    odometry: Any = importlib.import_module("nav_msgs.msg").Odometry
    ages_ms: list[float] = []
    has_all = threading.Event()

    def take(cdr: bytes) -> None:
        seconds, ns = (int.from_bytes(cdr[at : at + 4], "little") for at in (4, 8))
        ages_ms.append((time.time_ns() - seconds * SECOND_NS - ns) / 1e6)
        if len(ages_ms) == n:
            has_all.set()

    node.create_subscription(odometry, "/robot_1/odom", take, 1000, raw=True)
    threading.Thread(target=lambda: rclpy.spin(node), daemon=True).start()
    say("ready")
    sys.stdin.readline()
    has_all.wait(5.0)
    say(ages_ms)
    sys.stdin.readline()


def graph(_: Any, node: Any, n: int) -> None:  # noqa: ANN401
    """Have publishers, as an idle robot does."""
    text: Any = importlib.import_module("std_msgs.msg").String
    for i in range(n):
        node.create_publisher(text, f"/sensors/number_{i}", 10)
    say("ready")
    sys.stdin.readline()


if __name__ == "__main__":
    main()
