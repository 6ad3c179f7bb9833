"""Services of nodes here that other robots may call, and their calls that are under way."""

from collections import Counter
from collections.abc import Mapping
from random import Random
from typing import Any, NamedTuple

from rclpy.serialization import deserialize_message, serialize_message

from sdrlink_ros.kinds import ServiceKind, service_kind
from sdrlink_ros.sayings import Sayings
from sdrlinkd.calls import Answerer, Key, Packet, Sent, Service, Status

FOUND_S = 3.0
"""Time in s that a client has to find its server."""


class Client(NamedTuple):
    """A client of a server here, which is called `name`."""

    name: str
    kind: ServiceKind
    client: Any


class _Waiting(NamedTuple):
    until: float
    key: Key
    packet: Packet


class Servers:
    """Hands the calls of other robots to the servers here. It begins at `now`.

    `counts` are the calls by how they ended. One thread uses it.
    """

    def __init__(
        self,
        node: Any,  # noqa: ANN401
        now: float,
        rng: Random,
        sayings: Sayings,
        counts: Counter[str],
    ) -> None:
        self._node = node
        self._sayings = sayings
        self._counts = counts
        self._answerer = Answerer(now, rng)
        self._offered: Mapping[str, Service] = {}
        self._clients: dict[str, Client] = {}
        self._running: dict[tuple[str, int], Key] = {}
        """Calls that a server works on, by its name and the number of the request."""
        self._waiting: list[_Waiting] = []
        """Calls whose servers are not found yet."""

    @property
    def is_busy(self) -> bool:
        """Whether calls wait, run, or have an answer that was not acknowledged."""
        return bool(self._waiting or self._answerer)

    @property
    def clients(self) -> list[Client]:
        """The clients, to be waited for."""
        return list(self._clients.values())

    def offer(self, offered: Mapping[str, Service]) -> None:
        """Let others call these services, by name here, from now on, and no others."""
        self._offered = offered
        for name in [each for each in self._clients if each not in offered]:
            self._node.destroy_client(self._clients.pop(name).client)

    def hear(self, robot: int, packet: Packet, took_s: float | None, now: float) -> None:
        """Take a request or an acknowledgement, which was `took_s` on its way."""
        key = self._answerer.hear(robot, packet, took_s, now)
        if key is not None:
            self._execute(_Waiting(now + FOUND_S, key, packet), now)

    def take_response(self, client: Client, now: float) -> None:
        """Take the answer of a server here."""
        header, response = client.client.handle.take_response(client.kind.service.Response)
        if header is None:
            return
        key = self._running.pop((client.name, header.request_id.sequence_number), None)
        if key is not None:
            self._answerer.answer(key, Status.OK, serialize_message(response), now)

    def due(self, now: float) -> list[Sent]:
        """The packets to be sent at `now`; calls whose servers have gone end."""
        waiting, self._waiting = self._waiting, []
        for each in waiting:
            if now < each.until:
                self._execute(each, now)
            else:
                self._answerer.answer(each.key, Status.SERVER_ENDED, b"", now)
        gone = {name for name, _ in self._running if not self._has_server(name)}
        for running in [each for each in self._running if each[0] in gone]:
            self._answerer.answer(self._running.pop(running), Status.SERVER_ENDED, b"", now)
        return self._answerer.due(now)

    def too_large(self, packet: Packet, robot: int) -> None:
        """Tell a caller that its answer does not fit the link."""
        self._answerer.too_large(packet, robot)

    def _has_server(self, name: str) -> bool:
        client = self._clients.get(name)
        return client is not None and client.client.service_is_ready()

    def _execute(self, waiting: _Waiting, now: float) -> None:
        """Hand a call to its server, or answer why that cannot be."""
        key, packet = waiting.key, waiting.packet
        here = (name for name, each in self._offered.items() if each.name == packet.name)
        name = next(here, None)
        if name is None:
            self._answerer.answer(key, Status.NO_SERVER, b"", now)
            return
        try:
            client = self._client(name)
            if not client.kind.fits_request(packet.body):
                self._answerer.answer(key, Status.OTHER_TYPE, b"", now)
            elif not client.client.service_is_ready():
                # A client that was made just now has yet to find its server.
                self._waiting.append(waiting)
            else:
                request = deserialize_message(packet.body, client.kind.service.Request)
                self._running[name, client.client.handle.send_request(request)] = key
                self._counts["executed"] += 1
        except Exception as error:  # octets from the air that are no request end no other call
            self._sayings.once(f"{name} called by robot {key.robot}: {error}")
            self._answerer.answer(key, Status.OTHER_TYPE, b"", now)

    def _client(self, name: str) -> Client:
        if name not in self._clients:
            kind = service_kind(self._offered[name].kind)
            made = self._node.create_client(kind.service, name)
            self._clients[name] = Client(name, kind, made)
        return self._clients[name]
