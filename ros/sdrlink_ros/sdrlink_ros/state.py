"""What the bridge tells ROS about the link: /diagnostics, /link/status and /link/topics."""

import json
from collections.abc import Mapping
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.serialization import serialize_message
from std_msgs.msg import String

from sdrlink_ros.echoes import Echoes

LEVELS = {
    "OK": DiagnosticStatus.OK,
    "DEGRADED": DiagnosticStatus.WARN,
    "DOWN": DiagnosticStatus.ERROR,
}
DEPTH = 1
DIAGNOSTICS = "/diagnostics"


class State:
    """The publishers of the bridge's own topics, on `node`; each gets one message a second.

    The daemon's whole state is asked for only while somebody listens.

    /link/status has the JSON of `sdrlinkctl status --json`, and /link/topics that of a list of
    topics: what the bridge sends and publishes, and why it leaves out the others.
    """

    def __init__(self, node: Any, echoes: Echoes) -> None:  # noqa: ANN401
        self._node = node
        self._echoes = echoes
        self._diagnostics = node.create_publisher(DiagnosticArray, DIAGNOSTICS, DEPTH)
        self._status = node.create_publisher(String, "/link/status", DEPTH)
        self._topics = node.create_publisher(String, "/link/topics", DEPTH)

    @property
    def is_wanted(self) -> bool:
        """Whether anybody here listens."""
        publishers = (self._diagnostics, self._status, self._topics)
        return any(publisher.get_subscription_count() for publisher in publishers)

    def tell(
        self, robot: int, snapshot: "Mapping[str, Any] | None", topics: list[dict[str, Any]]
    ) -> None:
        """Publish the state; `snapshot` is the daemon's, None while it is away."""
        status = diagnosis(robot, snapshot)
        stamp = self._node.get_clock().now().to_msg()
        array = DiagnosticArray(status=[status])
        array.header.stamp = stamp
        # Other robots get this robot's /diagnostics without the bridge's own.
        cdr = serialize_message(array)
        self._echoes.sent(DIAGNOSTICS, cdr)
        self._diagnostics.publish(cdr)
        if snapshot is not None:
            self._status.publish(String(data=json.dumps(snapshot, allow_nan=False, default=str)))
        self._topics.publish(String(data=json.dumps(topics)))


def diagnosis(robot: int, snapshot: "Mapping[str, Any] | None") -> DiagnosticStatus:
    """The link's state as one diagnostic status."""
    status = DiagnosticStatus(name=f"sdrlinkd: link of robot {robot}", hardware_id=f"robot_{robot}")
    if snapshot is None:
        status.level, status.message = DiagnosticStatus.STALE, "the daemon does not answer"
        return status
    verdict, link = snapshot["verdict"], snapshot["link"]
    status.level = LEVELS.get(verdict["level"], DiagnosticStatus.WARN)
    status.message = "; ".join(verdict["reasons"]) or f"OK, {verdict['protection']}"
    tx, rx = link["tx"], link["rx"]
    values = {
        "protection": verdict["protection"],
        "radio": f"{snapshot['carrier']['kind']} {snapshot['carrier']['state']}",
        "messages sent": tx["sent"],
        "messages queued": tx["queued"],
        "messages delivered": rx["delivered"],
    }
    for neighbor in link["neighbors"]:
        values[f"robot {neighbor['src']} SNR (dB)"] = _shown(neighbor.get("snr_db"))
    for way in (tx, rx):
        values |= {f"dropped: {reason}": n for reason, n in way["dropped"].items() if n}
    status.values = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
    return status


def _shown(snr_db: "float | None") -> str:
    return "unknown" if snr_db is None else f"{snr_db:.1f}"
