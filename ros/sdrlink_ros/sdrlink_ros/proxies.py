"""Services of other robots as they appear here, and the calls of nodes here that are under way."""

from collections import Counter
from collections.abc import Mapping
from random import Random
from typing import Any, NamedTuple

from rclpy.serialization import deserialize_message, serialize_message

from sdrlink_ros.directory import request_hash
from sdrlink_ros.kinds import ServiceKind, service_kind
from sdrlink_ros.names import Names
from sdrlink_ros.sayings import Sayings
from sdrlinkd.calls import ACTION, WORDS, Asker, Ended, Packet, Sent, Service, Status

MOST_PROXIES = 500


class Proxy(NamedTuple):
    """A service of another robot, as it appears here."""

    robot: int
    service: Service
    kind: ServiceKind
    server: Any


class Asked(NamedTuple):
    """A call of a node here that is under way."""

    proxy: Proxy
    header: Any


class Proxies:
    """Serves what other robots offer, and asks them. `boot` is this bridge's boot number.

    `counts` are the calls by how they ended. One thread uses it.
    """

    def __init__(
        self,
        node: Any,  # noqa: ANN401
        names: Names,
        boot: int,
        rng: Random,
        sayings: Sayings,
        counts: Counter[str],
    ) -> None:
        self._node = node
        self._names = names
        self._sayings = sayings
        self._counts = counts
        self._asker = Asker(boot, rng)
        self._asked: dict[int, Asked] = {}
        self._proxies: dict[str, Proxy] = {}

    @property
    def is_busy(self) -> bool:
        """Whether calls are under way."""
        return bool(self._asked)

    @property
    def services(self) -> Mapping[str, Service]:
        """The services that appear here, by name here."""
        return {name: proxy.service for name, proxy in self._proxies.items()}

    @property
    def servers(self) -> list[Proxy]:
        """The proxies, to be waited for."""
        return list(self._proxies.values())

    def settle(self, offered: Mapping[int, list[Service]]) -> None:
        """Have a proxy for each service that the robots offer.

        A call that is under way keeps its proxy, and a goal all those of its action: it can be
        cancelled though its robot is silent.
        """
        wanted = {
            self._names.here(robot, service.name[1:]): (robot, service)
            for robot, services in offered.items()
            for service in services
        }
        in_use = {_whole(asked.proxy) for asked in self._asked.values()}
        for name, proxy in list(self._proxies.items()):
            if wanted.get(name) != (proxy.robot, proxy.service) and _whole(proxy) not in in_use:
                del self._proxies[name]
                self._node.destroy_service(proxy.server)
        for name, (robot, service) in wanted.items():
            if name not in self._proxies:
                self._open(name, robot, service)

    def take_request(self, proxy: Proxy, timeout_s: float, now: float) -> None:
        """Take a call of a node here."""
        request, header = proxy.server.handle.service_take_request(proxy.kind.service.Request)
        if request is None or header is None:
            return
        body = serialize_message(request)
        number = self._asker.ask(proxy.robot, proxy.service.name, body, now, timeout_s=timeout_s)
        self._asked[number] = Asked(proxy, header)
        self._counts["asked"] += 1

    def hear(self, robot: int, packet: Packet, now: float) -> None:
        """Take an answer, or word that a call runs."""
        ended = self._asker.hear(robot, packet, now)
        if ended is not None:
            self._end(ended)

    def due(self, now: float) -> list[Sent]:
        """The packets to be sent at `now`; calls whose time is over end."""
        for ended in self._asker.expired(now):
            self._end(ended)
        return self._asker.due(now)

    def too_large(self, packet: Packet) -> None:
        """End a call whose request does not fit the link."""
        self._asker.drop(packet.number)
        self._end(Ended(packet.number, Status.TOO_LARGE))

    def _open(self, name: str, robot: int, service: Service) -> None:
        if len(self._proxies) >= MOST_PROXIES:
            self._sayings.once(f"{name}: {MOST_PROXIES} services of others appear here already")
            return
        try:
            kind = service_kind(service.kind)
            server = self._node.create_service(kind.service, name, _never)
        except Exception as error:  # a name or a type from the air must not hide the others
            self._sayings.once(f"{name} of robot {robot}: {error}")
            return
        own = request_hash(self._node, name)
        if own and service.hash and own != service.hash:
            self._node.destroy_service(server)
            self._sayings.once(f"{name}: {WORDS[Status.OTHER_TYPE]}")
            return
        self._proxies[name] = Proxy(robot, service, kind, server)

    def _end(self, ended: Ended) -> None:
        asked = self._asked.pop(ended.number, None)
        if asked is None:
            return
        proxy, status, body = asked.proxy, ended.status, ended.body
        if status == Status.OK and proxy.kind.fits_response(body):
            response = deserialize_message(body, proxy.kind.service.Response)
            proxy.server.send_response(response, asked.header)
            self._counts["answered"] += 1
            return
        # ROS has no error for a call. The caller's own time-out is the error.
        words = WORDS.get(status, WORDS[Status.OTHER_TYPE])
        self._counts[words] += 1
        self._sayings.say(f"{proxy.service.name} of robot {proxy.robot}: {words}")


def _whole(proxy: Proxy) -> tuple[int, str]:
    """The service that a proxy stands for, or the action of which it is a part."""
    return proxy.robot, proxy.service.name.split(ACTION)[0]


def _never(_: Any, response: Any) -> Any:  # noqa: ANN401
    """The callback that rclpy asks for; no executor calls it."""
    return response
