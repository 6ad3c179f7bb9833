"""The peers by name, and which of them can run here."""

from typing import NamedTuple

from benchmarks import environments


class Peer(NamedTuple):
    """A system that a team would use."""

    of: str
    """The software that this peer imitates."""
    transports: dict[str, str]
    """The transport of each class of topics; "default" is for all classes not listed."""
    environment: str = ""
    """The virtual environment it needs; see `environments`."""


PEERS: dict[str, Peer] = {
    "tcp_nagle": Peer("ROS 1, TCPROS", {"default": "tcp_nagle"}),
    "tcp_delayed_ack": Peer("ROS 1, TCPROS, kernels before 2024", {"default": "tcp_delayed_ack"}),
    "tcp_nodelay": Peer("ROS 1, TCPROS without Nagle", {"default": "tcp_nodelay"}),
    "udp": Peer("ROS 1, UDPROS", {"default": "udpros"}),
    "udp_nod": Peer("ROS 1, both", {"latency": "udpros", "default": "tcp_nodelay"}),
    "nimbro_udp": Peer("nimbro_network", {"default": "nimbro_udp"}),
    "nimbro_udp_tcp": Peer(
        "nimbro_network, both", {"latency": "nimbro_udp", "default": "nimbro_tcp"}
    ),
    "pound_like": Peer("Pound", {"default": "pound"}),
    "zenoh_drop": Peer("Zenoh", {"default": "drop"}, "zenoh"),
    "zenoh_block": Peer("Zenoh", {"default": "block"}, "zenoh"),
    "fastdds_reliable": Peer("ROS 2, Fast DDS", {"default": "reliable"}, "ros"),
    "fastdds_best_effort": Peer("ROS 2, Fast DDS", {"default": "best_effort"}, "ros"),
}


def unavailable(peer: str) -> str | None:
    """Why a peer cannot run here, or None if it can; creates the environment that it needs."""
    return environments.unavailable(PEERS, peer)
