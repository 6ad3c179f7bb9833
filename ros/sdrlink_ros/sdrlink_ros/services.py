"""Services between ROS and the radio: proxies of those elsewhere, and clients of those here.

One thread owns all entities, and waits for them without an executor: no call blocks another.
"""

import secrets
import threading
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from queue import Empty, SimpleQueue
from random import SystemRandom
from typing import Any, NamedTuple

from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.serialization import deserialize_message, serialize_message

from sdrlink_ros.actions import ActionTopics
from sdrlink_ros.calls import Answerer, Asker, Ended, Key, Sent
from sdrlink_ros.directory import MOST_TOLD, Service, request_hash, told, understood
from sdrlink_ros.kinds import ServiceKind, service_kind
from sdrlink_ros.names import Names, command_name
from sdrlink_ros.outlet import Source
from sdrlink_ros.packet import WORDS, Kind, Packet, Status
from sdrlinkd.client import Message, MessageRefusedError, Publisher

DIRECTORY, CALLS = "_sdrlink/services", "_sdrlink/calls"
CALL_TYPE, TEXT = "sdrlink_ros/msg/Call", "std_msgs/msg/String"
INNER = "_sdrlink/"
"""Beginning of the names that bridges use among themselves."""
BUSY_S, IDLE_S = 0.02, 0.5
"""Longest wait in s of the thread, with and without calls that are not over."""
LOST_S = 3.0
"""Time of silence in s after which the proxies of a robot's services go."""
STOP_S = 2.0
MOST_PROXIES = 500
MOST_SHOWN = 128
MOST_SAID = 1000


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


class Services:
    """Calls in both directions. `node` is for its entities only, and `say` logs a sentence."""

    def __init__(
        self,
        node: Any,  # noqa: ANN401
        names: Names,
        directory: Path | None,
        say: Callable[[str], None],
    ) -> None:
        self._node = node
        self._names = names
        self._directory = directory
        self._say = say
        rng = SystemRandom()
        self._asker = Asker(secrets.randbits(32), rng)
        self._answerer = Answerer(time.monotonic(), rng)
        self._actions = ActionTopics(node, names)
        self._offered: Mapping[str, Service] = {}
        self._told: dict[int, list[Service]] = {}
        self._silent: frozenset[int] = frozenset()
        self._reached: frozenset[int] = frozenset()
        self._timeout_s = 0.0
        self._proxies: dict[str, Proxy] = {}
        self._clients: dict[str, tuple[Any, ServiceKind]] = {}
        self._asked: dict[int, Asked] = {}
        self._running: dict[tuple[str, int], Key] = {}
        self._waiting: list[tuple[float, Key, Packet]] = []
        """Calls whose servers are not found yet, and until when they wait."""
        self._said: set[str] = set()
        self._has_offered = False
        # Another thread counts the first one up, and this one catches up with it.
        self._to_tell = self._has_told = 0
        self._inbox: SimpleQueue[Message] = SimpleQueue()
        self.counts: Counter[str] = Counter()
        """Calls by how they ended."""
        self._is_over = False
        self._is_changed = True
        self._news = node.create_guard_condition(lambda: None)
        self._thread = threading.Thread(target=self._run, name="caller", daemon=True)

    # From the bridge's other threads.

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def stop(self) -> None:
        """End the thread."""
        self._is_over = True
        self._news.trigger()
        self._thread.join(STOP_S)

    def offer(self, offered: Mapping[str, Service], timeout_s: float) -> None:
        """Offer these services of this robot's nodes, by name here, from now on."""
        self._timeout_s = timeout_s
        if offered != self._offered:
            self._offered, self._is_changed = dict(offered), True
            self._has_offered = self._has_offered or bool(offered)
            self.tell_again()

    @property
    def has_proxies(self) -> bool:
        """Whether services of other robots appear here, or did."""
        return bool(self._told)

    def silent(self, robots: frozenset[int]) -> None:
        """Note which robots have not been heard for a while."""
        if robots != self._silent:
            self._silent, self._is_changed = robots, True
            self._news.trigger()

    def reach(self, robots: frozenset[int]) -> None:
        """Note the robots to which calls can be sent, as the daemon knows their topics."""
        if robots != self._reached:
            self._reached, self._is_changed = robots, True
            self._news.trigger()

    def declarations(self, sources: Sequence[Source]) -> list[dict[str, Any]]:
        """The topics that calls need, as arguments of the verb `declare`."""
        has_offers = self._has_offered
        peers = {each.robot for each in sources if has_offers or each.name.startswith(INNER)}
        topics: list[dict[str, Any]] = [
            {"name": calls_of(robot), "type": CALL_TYPE} for robot in sorted(peers)
        ]
        if has_offers:
            latched = {"durability": "transient_local", "depth": 1}
            topics.append({"name": f"/{DIRECTORY}", "type": TEXT, **latched})
            topics += self._actions.declarations(self._offered)
        return topics

    def tell_again(self) -> None:
        """Tell what is offered once more, as it has changed or the daemon has restarted."""
        self._to_tell += 1
        self._news.trigger()

    def hears(self, source: Source) -> bool:
        """Whether a topic of another robot is of bridges among themselves, and is for this one."""
        calls = command_name(self._names.own, f"/{CALLS}")
        return source.name == calls or source.name.startswith(INNER)

    def hear(self, message: Message) -> None:
        """Take a message of such a topic."""
        self._inbox.put(message)
        self._news.trigger()

    # The thread.

    def _run(self) -> None:
        with Publisher(self._directory, timeout_s=0.0) as out:
            while not self._is_over:
                try:
                    self._turn(out)
                except Exception as error:  # noqa: PERF203
                    if self._is_over or not self._node.context.ok():
                        break
                    self._say(f"services: an error, which ends no other call: {error}")
                    time.sleep(BUSY_S)

    def _turn(self, out: Publisher) -> None:
        """One round: what changed, what came, what is due, and then a wait."""
        if self._is_changed:
            self._is_changed = False
            self._settle()
        to_tell = self._to_tell
        if self._has_offered and to_tell != self._has_told and self._tell(out):
            self._has_told = to_tell
        while True:
            try:
                message = self._inbox.get_nowait()
            except Empty:
                break
            self._take(message)
        now = time.monotonic()
        waiting, self._waiting = self._waiting, []
        for until, key, packet in waiting:
            if now < until:
                self._execute(key, packet, now, until)
            else:
                self._answerer.answer(key, Status.SERVER_ENDED, b"", now)
        for ended in self._asker.expired(now):
            self._end(ended)
        self._watch_servers(now)
        for sent in (*self._asker.due(now), *self._answerer.due(now)):
            self._send(sent, out)
        self._wait(out)

    def _wait(self, out: Publisher) -> None:
        """Wait until something comes, and take what ROS brings."""
        proxies, clients = list(self._proxies.values()), list(self._clients.items())
        topics = self._actions.taps
        wait_set = _rclpy.WaitSet(
            len(topics), 1, 0, len(clients), len(proxies), 0, self._node.context.handle
        )
        wait_set.clear_entities()
        for tap in topics:
            wait_set.add_subscription(tap.subscription.handle)
        for proxy in proxies:
            wait_set.add_service(proxy.server.handle)
        for _, (client, _kind) in clients:
            wait_set.add_client(client.handle)
        wait_set.add_guard_condition(self._news.handle)
        is_busy = len(self._asker) or len(self._answerer) or self._waiting
        wait_set.wait(int(1e9 * (BUSY_S if is_busy else IDLE_S)))
        ready = {
            kind: set(wait_set.get_ready_entities(kind))
            for kind in ("subscription", "service", "client")
        }
        for proxy in proxies:
            if proxy.server.handle.pointer in ready["service"]:
                self._take_request(proxy)
        for name, (client, kind) in clients:
            if client.handle.pointer in ready["client"]:
                self._take_response(name, client, kind)
        for tap in topics:
            if tap.subscription.handle.pointer in ready["subscription"]:
                self._actions.forward(tap, out)

    def _tell(self, out: Publisher) -> bool:
        """Tell the other robots what is offered; False if the daemon does not take it yet."""
        offered = list(self._offered.values())
        if len(offered) > MOST_TOLD:
            self._say_once(f"services.allow names {len(offered)} services; {MOST_TOLD} are offered")
        text = told(offered[:MOST_TOLD])
        try:
            return bool(out.send(f"/{DIRECTORY}", text, wait=False))
        except MessageRefusedError as error:
            if error.reason != "tx_unknown_topic":
                self._say_once(f"the services cannot be offered yet: {error}")
            return False

    def _settle(self) -> None:
        """Have a client for each call of what is offered, and a proxy for what is told."""
        self._actions.offer(self._offered)
        for name in [each for each in self._clients if each not in self._offered]:
            self._node.destroy_client(self._clients.pop(name)[0])
        wanted = {
            self._names.here(robot, service.name[1:]): (robot, service)
            for robot, services in self._told.items()
            for service in services
            if robot in self._reached and robot not in self._silent
        }
        in_use = {asked.proxy.server for asked in self._asked.values()}
        for name, proxy in list(self._proxies.items()):
            # An outage ends no call.
            if wanted.get(name) != (proxy.robot, proxy.service) and proxy.server not in in_use:
                del self._proxies[name]
                self._node.destroy_service(proxy.server)
        for name, (robot, service) in wanted.items():
            if name not in self._proxies:
                self._open(name, robot, service)
        self._actions.show({name: proxy.service for name, proxy in self._proxies.items()})

    def _open(self, name: str, robot: int, service: Service) -> None:
        if len(self._proxies) >= MOST_PROXIES:
            self._say_once(f"{name} of robot {robot}: {MOST_PROXIES} services appear here already")
            return
        try:
            kind = service_kind(service.kind)
            server = self._node.create_service(kind.service, name, _never)
        except Exception as error:  # a name or a type from the air must not hide the others
            self._say_once(f"{name[:MOST_SHOWN]} of robot {robot}: {error}")
            return
        own = request_hash(self._node, name)
        if own and service.hash and own != service.hash:
            self._node.destroy_service(server)
            self._say_once(f"{name}: {WORDS[Status.OTHER_TYPE]}")
            return
        self._proxies[name] = Proxy(robot, service, kind, server)

    def _take(self, message: Message) -> None:
        robot, now = message.source, time.monotonic()
        if message.topic.endswith(f"/{DIRECTORY}"):
            services = understood(message.payload)
            if services is not None:
                self._told[robot] = services
                self._settle()
            return
        if not message.topic.endswith(f"/{CALLS}"):
            self._actions.publish(robot, message)
            return
        packet = Packet.parse(message.payload)
        if packet is None:
            self.counts["rx_bad_cdr"] += 1
        elif packet.kind in (Kind.REQUEST, Kind.ACK):
            took_s = None if message.age_us is None else 1e-6 * message.age_us
            key = self._answerer.hear(robot, packet, took_s, now)
            if key is not None:
                self._execute(key, packet, now, now + LOST_S)
        elif (ended := self._asker.hear(robot, packet, now)) is not None:
            self._end(ended)

    # Calls of nodes here.

    def _take_request(self, proxy: Proxy) -> None:
        request, header = proxy.server.handle.service_take_request(proxy.kind.service.Request)
        if request is None or header is None:
            return
        service = proxy.service
        number = self._asker.ask(
            proxy.robot, service.name, serialize_message(request), time.monotonic(),
            timeout_s=self._timeout_s,
        )  # fmt: skip
        self._asked[number] = Asked(proxy, header)
        self.counts["asked"] += 1

    def _end(self, ended: Ended) -> None:
        asked = self._asked.pop(ended.number, None)
        if asked is None:
            return
        proxy, name = asked.proxy, asked.proxy.service.name
        status, body = ended.status, ended.body
        if status == Status.OK and len(body) >= proxy.kind.least_response:
            response = deserialize_message(body, proxy.kind.service.Response)
            proxy.server.send_response(response, asked.header)
            self.counts["answered"] += 1
            return
        # ROS has no error for a call. The caller's own time-out is the error.
        words = WORDS.get(status, WORDS[Status.OTHER_TYPE])
        self.counts[words] += 1
        self._say(f"{name} of robot {proxy.robot}: {words}")

    # Calls of other robots.

    def _execute(self, key: Key, packet: Packet, now: float, until: float) -> None:
        """Hand a call to its server, which has until then to be found."""
        offered = self._offered
        name = next((own for own, each in offered.items() if each.name == packet.name), None)
        if name is None:
            self._answerer.answer(key, Status.NO_SERVER, b"", now)
            return
        try:
            self._hand_over(key, packet, name, offered[name].kind, now, until)
        except Exception as error:  # octets from the air that are no request end no other call
            self._say(f"{name} called by robot {key.robot}: {error}")
            self._answerer.answer(key, Status.OTHER_TYPE, b"", now)

    def _hand_over(
        self, key: Key, packet: Packet, name: str, type_: str, now: float, until: float
    ) -> None:
        if name not in self._clients:
            kind = service_kind(type_)
            self._clients[name] = self._node.create_client(kind.service, name), kind
        client, kind = self._clients[name]
        if len(packet.body) < kind.least_request:
            self._answerer.answer(key, Status.OTHER_TYPE, b"", now)
            return
        if not client.service_is_ready():
            # A client that was made just now has yet to find its server.
            self._waiting.append((until, key, packet))
            return
        request = deserialize_message(packet.body, kind.service.Request)
        self._running[name, client.handle.send_request(request)] = key
        self.counts["executed"] += 1

    def _take_response(self, name: str, client: Any, kind: ServiceKind) -> None:  # noqa: ANN401
        header, response = client.handle.take_response(kind.service.Response)
        if header is None:
            return
        key = self._running.pop((name, header.request_id.sequence_number), None)
        if key is not None:
            body = serialize_message(response)
            self._answerer.answer(key, Status.OK, body, time.monotonic())

    def _watch_servers(self, now: float) -> None:
        """Answer the calls whose server has ended."""
        for name in {name for name, _ in self._running}:
            if name in self._clients and self._clients[name][0].service_is_ready():
                continue
            for running in [each for each in self._running if each[0] == name]:
                key = self._running.pop(running)
                self._answerer.answer(key, Status.SERVER_ENDED, b"", now)

    def _send(self, sent: Sent, out: Publisher) -> None:
        robot, packet = sent
        if robot not in self._reached:
            # It is sent again later.
            return
        is_cancel = packet.name.endswith("/cancel_goal")
        try:
            out.send(
                calls_of(robot), packet.build(), dst=robot,
                qos="urgent" if is_cancel else "latency", wait=False,
            )  # fmt: skip
        except MessageRefusedError as error:
            if error.reason == "tx_unknown_topic":
                # The daemon has restarted, and does not know the topic yet.
                return
            self._say_once(f"call of {packet.name or 'a service'}, robot {robot}: {error}")
            if packet.kind == Kind.REQUEST:
                self._asker.drop(packet.number)
                self._end(Ended(packet.number, Status.TOO_LARGE))
            else:
                self._answerer.too_large(packet, robot)

    def _say_once(self, text: str) -> None:
        if text not in self._said:
            if len(self._said) >= MOST_SAID:
                self._said.clear()
            self._said.add(text)
            self._say(text)


def calls_of(robot: int) -> str:
    """The bus topic of calls to a robot, and of answers to it."""
    return f"/{command_name(robot, '/' + CALLS)}"


def _never(_: Any, response: Any) -> Any:  # noqa: ANN401
    """The callback that rclpy asks for; no executor calls it."""
    return response
