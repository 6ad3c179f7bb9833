"""The ROS graph: what this gateway's node has, and what others have."""

from collections import Counter
from collections.abc import Callable
from typing import NamedTuple

from sdrlinkd.fleet.ros.names import (
    Endpoint,
    Node,
    Qos,
    Role,
    gid,
    read_endpoint,
    tokens,
)
from sdrlinkd.fleet.session import Session

GATEWAY = "sdrlink_gateway_"
"""Beginning of the names of gateways' nodes."""
MOST_KNOWN = 16384


class Opened(NamedTuple):
    """An endpoint of this gateway's node; `close` takes it down."""

    gid: bytes
    close: Callable[[], None]


class Graph:
    """The node of gateway `gateway` in a domain, and the endpoints of others."""

    def __init__(self, session: Session, domain: int, gateway: int) -> None:
        self._session = session
        self.domain = domain
        self._node = Node(domain, session.zid, f"{GATEWAY}{gateway}")
        self._n_opened = 0
        self.version = 0
        """Counts the changes of what others have."""
        self._others: dict[str, Endpoint] = {}
        self._wanted: dict[tuple[str, str], Counter[str]] = {}
        """Subscriptions by hash, by (topic, type as in DDS)."""

    def start(self) -> None:
        """Appear in the graph, and follow it."""
        self._session.token(self._node.token)
        self._session.watch(tokens(self.domain), self._note)

    def open(self, role: Role, name: str, kind: str, hash_: str, qos: Qos) -> Opened:
        """Add an endpoint to the node; `kind` as in DDS."""
        self._n_opened += 1
        token = self._node.endpoint(self._n_opened, role, name, kind, hash_, qos)
        return Opened(gid(token), self._session.token(token))

    def hashes(self, name: str, kind: str) -> list[str]:
        """The hashes that subscriptions to a topic know its type by."""
        return list(self._wanted.get((name, kind), ()))

    def published(self) -> set[tuple[str, str, str]]:
        """(topic, type as in DDS, hash) of the publishers of nodes that are no gateways."""
        return {
            (each.name, each.kind, each.hash)
            for each in self._others.values()
            if each.role is Role.PUBLISHER and not each.node.startswith(GATEWAY)
        }

    def _note(self, token: str, is_there: bool) -> None:
        self.version += 1
        known = self._others.pop(token, None)
        if known is not None:
            self._count(known, -1)
        endpoint = read_endpoint(token) if is_there else None
        if endpoint is None or endpoint.session == self._node.session:
            return
        if len(self._others) < MOST_KNOWN:
            self._others[token] = endpoint
            self._count(endpoint, 1)

    def _count(self, endpoint: Endpoint, by: int) -> None:
        if endpoint.role is Role.SUBSCRIPTION:
            topic = endpoint.name, endpoint.kind
            wanted = self._wanted.setdefault(topic, Counter())
            wanted[endpoint.hash] += by
            # Unary plus drops what has come to zero.
            self._wanted[topic] = +wanted
            if not self._wanted[topic]:
                del self._wanted[topic]
