"""Calls between this robot's nodes and other robots, over the bus.

One thread owns all entities, and waits for them without an executor: no call blocks another.
"""

import secrets
import threading
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from queue import SimpleQueue
from random import SystemRandom
from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy

from sdrlink_ros import actions
from sdrlink_ros.names import Names, command_name
from sdrlink_ros.outlet import Source
from sdrlink_ros.proxies import Proxies
from sdrlink_ros.sayings import Sayings
from sdrlink_ros.servers import Servers
from sdrlinkd.calls import (
    CALL_TYPE,
    CALLS,
    DIRECTORY,
    INNER,
    MOST_TOLD,
    TEXT,
    Kind,
    Packet,
    Sent,
    Service,
    calls_name,
    told,
    understood,
)
from sdrlinkd.client import UNKNOWN_TOPIC, Message, MessageRefusedError, Publisher

BUSY_S, IDLE_S = 0.02, 0.5
"""Longest wait in s of the thread, with and without calls that are not over."""
LOST_S = 3.0
"""Time of silence in s after which the proxies of a robot's services go."""
STOP_S = 2.0


class Services:
    """Calls in both directions. `node` is for its entities only."""

    def __init__(
        self,
        node: Any,  # noqa: ANN401
        names: Names,
        directory: Path | None,
        sayings: Sayings,
    ) -> None:
        self._node = node
        self._names = names
        self._directory = directory
        self._sayings = sayings
        self.counts: Counter[str] = Counter()
        """Calls by how they ended."""
        rng, now = SystemRandom(), time.monotonic()
        self._proxies = Proxies(node, names, secrets.randbits(32), rng, sayings, self.counts)
        self._servers = Servers(node, now, rng, sayings, self.counts)
        self._outlets = actions.Outlets(node, names)
        # Set by the bridge's timer, and read by the thread.
        self._offered: Mapping[str, Service] = {}
        self._has_offered = False
        self._silent: frozenset[int] = frozenset()
        self._reached: frozenset[int] = frozenset()
        self._timeout_s = 0.0
        self._changes = self._tellings = 1
        # The thread's own.
        self._told: dict[int, list[Service]] = {}
        self._changes_seen = self._tellings_done = 0
        self._inbox: SimpleQueue[Message] = SimpleQueue()
        self._is_over = False
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
            self._offered = dict(offered)
            self._has_offered = self._has_offered or bool(offered)
            self._change()
            self.tell_again()

    def tell_again(self) -> None:
        """Tell what is offered once more, as it has changed or the daemon has restarted."""
        self._tellings += 1
        self._news.trigger()

    @property
    def has_proxies(self) -> bool:
        """Whether services of other robots appear here, or did."""
        return bool(self._told)

    def silent(self, robots: frozenset[int]) -> None:
        """Note which robots have not been heard for a while."""
        if robots != self._silent:
            self._silent = robots
            self._change()

    def reach(self, robots: frozenset[int]) -> None:
        """Note the robots to which calls can be sent, as the daemon knows their topics."""
        if robots != self._reached:
            self._reached = robots
            self._change()

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
            topics += actions.declarations(self._offered)
        return topics

    def hears(self, source: Source) -> bool:
        """Whether a topic of another robot is of bridges among themselves, and is for this one."""
        calls = command_name(self._names.own, f"/{CALLS}")
        return source.name == calls or source.name.startswith(INNER)

    def hear(self, message: Message) -> None:
        """Take a message of such a topic."""
        self._inbox.put(message)
        self._news.trigger()

    def _change(self) -> None:
        self._changes += 1
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
                    self._sayings.say(f"services: an error, which ends no other call: {error}")
                    time.sleep(BUSY_S)

    def _turn(self, out: Publisher) -> None:
        """One round: what changed, what came, what is due, and then a wait."""
        changes, tellings = self._changes, self._tellings
        if changes != self._changes_seen:
            self._changes_seen = changes
            self._settle()
        if self._has_offered and tellings != self._tellings_done and self._tell(out):
            self._tellings_done = tellings
        while not self._inbox.empty():
            self._take(self._inbox.get())
        now = time.monotonic()
        for sent in (*self._proxies.due(now), *self._servers.due(now)):
            self._send(sent, out)
        self._wait()

    def _wait(self) -> None:
        """Wait until something comes, and take what ROS brings."""
        proxies, clients = self._proxies.servers, self._servers.clients
        wait_set = _rclpy.WaitSet(0, 1, 0, len(clients), len(proxies), 0, self._node.context.handle)
        wait_set.clear_entities()
        wait_set.add_guard_condition(self._news.handle)
        for proxy in proxies:
            wait_set.add_service(proxy.server.handle)
        for each in clients:
            wait_set.add_client(each.client.handle)
        is_busy = self._proxies.is_busy or self._servers.is_busy
        wait_set.wait(int(1e9 * (BUSY_S if is_busy else IDLE_S)))
        now = time.monotonic()
        asked = wait_set.get_ready_entities("service")
        for proxy in proxies:
            if proxy.server.handle.pointer in asked:
                self._proxies.take_request(proxy, self._timeout_s, now)
        answered = wait_set.get_ready_entities("client")
        for each in clients:
            if each.client.handle.pointer in answered:
                self._servers.take_response(each, now)

    def _settle(self) -> None:
        """Have what the offers of this robot and of the others ask for."""
        self._servers.offer(self._offered)
        present = self._reached - self._silent
        self._proxies.settle({r: each for r, each in self._told.items() if r in present})
        self._outlets.settle(self._proxies.services)

    def _tell(self, out: Publisher) -> bool:
        """Tell the other robots what is offered; False if the daemon does not take it yet."""
        offered = list(self._offered.values())
        if len(offered) > MOST_TOLD:
            self._sayings.once(
                f"services.allow names {len(offered)} services; {MOST_TOLD} are offered"
            )
        text = told(offered[:MOST_TOLD])
        try:
            return bool(out.send(f"/{DIRECTORY}", text, wait=False))
        except MessageRefusedError as error:
            if error.reason != UNKNOWN_TOPIC:
                self._sayings.once(f"the services cannot be offered: {error}")
            return False

    def _take(self, message: Message) -> None:
        """Take what another bridge sent."""
        robot, now = message.source, time.monotonic()
        if message.topic.endswith(f"/{DIRECTORY}"):
            services = understood(message.payload)
            if services is not None:
                self._told[robot] = services
                self._settle()
        elif not message.topic.endswith(f"/{CALLS}"):
            self._outlets.publish(robot, message)
        elif (packet := Packet.parse(message.payload)) is None:
            self.counts["rx_bad_cdr"] += 1
        elif packet.kind in (Kind.REQUEST, Kind.ACK):
            took_s = None if message.age_us is None else 1e-6 * message.age_us
            self._servers.hear(robot, packet, took_s, now)
        else:
            self._proxies.hear(robot, packet, now)

    def _send(self, sent: Sent, out: Publisher) -> None:
        robot, packet = sent
        if robot not in self._reached:
            # It is sent again later.
            return
        qos = "urgent" if packet.is_cancel else "latency"
        try:
            out.send(calls_of(robot), packet.build(), dst=robot, qos=qos, wait=False)
        except MessageRefusedError as error:
            if error.reason == UNKNOWN_TOPIC:
                # The daemon has restarted, and does not know the topic yet.
                return
            self._sayings.once(f"call of {packet.name or 'a service'}, robot {robot}: {error}")
            if packet.kind == Kind.REQUEST:
                self._proxies.too_large(packet)
            else:
                self._servers.too_large(packet, robot)


def calls_of(robot: int) -> str:
    """The bus topic of calls to a robot, and of answers to it."""
    return f"/{calls_name(robot)}"
