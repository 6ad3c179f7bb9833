"""From ROS to the radio: subscriptions, and a thread that hands their messages to the daemon."""

import threading
import time
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy

from sdrlink_ros import qos
from sdrlink_ros.daemon import Daemon
from sdrlink_ros.echoes import Echoes
from sdrlink_ros.kinds import Kind, UnknownTypeError, kind
from sdrlink_ros.routes import TF_STATIC, Route
from sdrlink_ros.sayings import Sayings
from sdrlinkd.client import UNKNOWN_TOPIC, MessageRefusedError, Publisher, RefusedError

LINGER_S = 2.0
"""Time in s for which a topic is still taken after the last demand for it."""
FIRST_REGISTERED = 16
"""Topics of the registry have smaller numbers; nobody says whether they are wanted."""
AGAIN_S = 10.0
"""Time in s after which a refused declaration is tried again."""
MOST_AT_ONCE = 16
AGAIN_NS = 50_000_000
EARLY_S, MOST_EARLY = 5.0, 256
"""How long, in s, and how many latched messages may wait for the daemon to announce their topic."""
STOP_S = 2.0


class Spec(NamedTuple):
    """A subscription to be made, and where its messages go."""

    name: str
    kind: Kind
    bus: str
    robot: int | None
    is_reliable: bool
    is_latched: bool
    head: bytes = b""
    """What is sent ahead of each message."""
    key: str | None = None
    """The producer key, if it does not depend on the message."""
    boot: str = ""
    """Of a latched topic, the start of the daemon: a new one lacks what was latched."""


class Tap(NamedTuple):
    """A subscription, and what it is for."""

    spec: Spec
    subscription: Any


class Outgoing:
    """Declares the topics of this robot, and takes their messages while they are wanted.

    `node` is for subscriptions only, and no executor may spin it.
    """

    def __init__(
        self,
        node: Any,  # noqa: ANN401
        directory: Path | None,
        echoes: Echoes,
        sayings: Sayings,
    ) -> None:
        self._sayings = sayings
        self.taker = Taker(node, directory, echoes, sayings)
        self._boot = ""
        self._told: dict[str, tuple[Any, ...]] = {}
        """What the daemon was told of each topic, by name."""
        self._numbers: dict[str, int] = {}
        self._wanted_at: dict[str, float] = {}
        self._again_at: dict[str, float] = {}
        self.refused: dict[str, str] = {}
        """Why the daemon, or a missing type, refuses a topic, in words by name."""

    def follow(self, routes: Mapping[str, Route], daemon: Daemon, boot: str) -> None:
        """Declare what is new or has changed since the last call."""
        if boot != self._boot:
            self._boot = boot
            self._told.clear()
            self._again_at.clear()
        for name, told in list(self._told.items()):
            route = routes.get(name)
            if route is None or told[:2] != _declaration(route)[:2]:
                if name not in self.refused:
                    # Its last publisher has gone: another type may take the name.
                    daemon.undeclare(told[0], told[1])
                del self._told[name]
        for name in [each for each in self.refused if each not in routes]:
            self._clear(name)
        for name, route in routes.items():
            is_new = self._told.get(name) != _declaration(route) or self._is_due(name)
            if is_new and self._declare(name, route, daemon):
                self._told[name] = _declaration(route)

    def want(
        self,
        routes: Mapping[str, Route],
        wanted: frozenset[str],
        more: Mapping[str, Spec],
        now: float,
    ) -> None:
        """Subscribe to what is wanted at `now` and to `more`, and to nothing else."""
        specs = dict(more)
        for name, route in routes.items():
            is_declared = self._told.get(name) == _declaration(route)
            number = self._numbers.get(route.bus) if is_declared else None
            if number is None or name in self.refused:
                continue
            if route.is_eager or route.bus in wanted or number < FIRST_REGISTERED:
                self._wanted_at[name] = now
            elif now - self._wanted_at.get(name, -LINGER_S) >= LINGER_S:
                continue
            offer = route.offer
            specs[name] = Spec(
                name, kind(offer.kind), route.bus, route.robot, offer.is_reliable,
                offer.is_latched, boot=self._boot if offer.is_latched else "",
            )  # fmt: skip
        self.taker.take(specs)

    def _is_due(self, name: str) -> bool:
        return name in self.refused and time.monotonic() >= self._again_at.get(name, 0.0)

    def _declare(self, name: str, route: Route, daemon: Daemon) -> bool:
        """Declare a topic; False if the daemon did not answer."""
        offer = route.offer
        arguments = {
            "name": route.bus,
            "type": offer.kind,
            "hash": offer.hash,
            "reliability": "reliable" if offer.is_reliable else "best_effort",
            "durability": "transient_local" if offer.is_latched else "volatile",
            "depth": route.depth,
        }
        try:
            kind(offer.kind)
            number = daemon.declare(arguments)
        except (UnknownTypeError, RefusedError) as error:
            self._again_at[name] = time.monotonic() + AGAIN_S
            self._refuse(name, f"{name}: {error}" if name not in str(error) else str(error))
            return True
        if number is not None:
            self._numbers[route.bus] = number
            self._clear(name)
        return number is not None

    def _refuse(self, name: str, text: str) -> None:
        self.refused[name] = text
        self._sayings.once(text)

    def _clear(self, name: str) -> None:
        self.refused.pop(name, None)
        self._again_at.pop(name, None)


class Taker:
    """A thread that owns the subscriptions, and sends what they bring.

    It waits for all of them at once without an executor, which spares half of the work for each
    message (`python -m benchmarks.adapters`). The pattern is that of rclpy.wait_for_message.
    """

    def __init__(
        self,
        node: Any,  # noqa: ANN401
        directory: Path | None,
        echoes: Echoes,
        sayings: Sayings,
    ) -> None:
        self._node = node
        self._directory = directory
        self._echoes = echoes
        self._sayings = sayings
        self._specs: Mapping[str, Spec] = {}
        self.taps: dict[str, Tap] = {}
        """The subscriptions that there are, by topic."""
        self.sent: Counter[str] = Counter()
        self.lost: Counter[str] = Counter()
        """Messages that the daemon was not there to take, by topic."""
        self.refused: Counter[str] = Counter()
        """Messages that the daemon does not accept, by topic."""
        self._early: list[tuple[Spec, bytes, Mapping[str, Any], float]] = []
        """Latched messages that came before the daemon has announced their topic."""
        self._is_over = False
        self._news = node.create_guard_condition(lambda: None)
        self._thread = threading.Thread(target=self._run, name="taker", daemon=True)

    def start(self) -> None:
        """Begin to take messages."""
        self._thread.start()

    def stop(self) -> None:
        """End the thread, and with it the subscriptions."""
        self._is_over = True
        self._news.trigger()
        self._thread.join(STOP_S)

    def take(self, specs: Mapping[str, Spec]) -> None:
        """Have exactly these subscriptions from now on."""
        if specs != self._specs:
            self._specs = dict(specs)
            self._news.trigger()

    def _run(self) -> None:
        with Publisher(self._directory, timeout_s=0.0) as out:
            while not self._is_over:
                try:
                    self._take(out)
                except Exception as error:  # noqa: PERF203 - one topic must not end the others
                    if self._is_over or not self._node.context.ok():
                        break
                    self._sayings.say(f"outgoing topics are set up again, after an error: {error}")
                    time.sleep(1.0)
            self._settle({})

    def _take(self, out: Publisher) -> None:
        """Take messages until the subscriptions change."""
        specs = self._specs
        self._settle(specs)
        by_pointer = {tap.subscription.handle.pointer: tap for tap in self.taps.values()}
        handles = [tap.subscription.handle for tap in self.taps.values()]
        guard = self._news.handle
        wait_set = _rclpy.WaitSet(len(handles), 1, 0, 0, 0, 0, self._node.context.handle)
        while specs is self._specs and not self._is_over:
            wait_set.clear_entities()
            for handle in handles:
                wait_set.add_subscription(handle)
            wait_set.add_guard_condition(guard)
            wait_set.wait(AGAIN_NS if self._early else -1)
            early, self._early = self._early, []
            for each in early:
                self._send(*each, out)
            for pointer in wait_set.get_ready_entities("subscription"):
                self._forward(by_pointer[pointer], out)

    def _forward(self, tap: Tap, out: Publisher) -> None:
        """Send the messages of a subscription that has some."""
        spec = tap.spec
        for _ in range(MOST_AT_ONCE):
            taken = tap.subscription.handle.take_message(spec.kind.message, True)
            if taken is None:
                return
            cdr, info = taken
            if not self._echoes.is_own(spec.name, cdr):
                self._send(spec, cdr, info, time.monotonic(), out)

    def _send(
        self, spec: Spec, cdr: bytes, info: Mapping[str, Any], taken_at: float, out: Publisher
    ) -> None:
        try:
            is_sent = out.send(
                spec.bus,
                spec.head + cdr if spec.head else cdr,
                dst=spec.robot,
                key=spec.key or _producer(spec, info),
                published_ns=info.get("source_timestamp") or None,
                wait=False,
            )
        except MessageRefusedError as error:
            is_early = error.reason == UNKNOWN_TOPIC and time.monotonic() - taken_at < EARLY_S
            if is_early and spec.is_latched and len(self._early) < MOST_EARLY:
                self._early.append((spec, cdr, info, taken_at))
                return
            self.refused[spec.name] += 1
            self._sayings.once(f"{spec.name}: {error}")
            return
        (self.sent if is_sent else self.lost)[spec.name] += 1

    def _settle(self, specs: Mapping[str, Spec]) -> None:
        """Make and destroy subscriptions, so that they are those of `specs`."""
        for name, tap in list(self.taps.items()):
            if specs.get(name) != tap.spec:
                del self.taps[name]
                self._node.destroy_subscription(tap.subscription)
        for name, spec in specs.items():
            if name in self.taps:
                continue
            profile = qos.subscription(spec.is_reliable, spec.is_latched)
            try:
                made = self._node.create_subscription(
                    spec.kind.message, name, _never, profile, raw=True
                )
            except Exception as error:
                self._sayings.once(f"{name}: {error}")
                continue
            self.taps[name] = Tap(spec, made)
        self._echoes.watched = frozenset(self.taps)


def _declaration(route: Route) -> tuple[Any, ...]:
    """All that the daemon is told of a topic."""
    offer = route.offer
    is_ = offer.is_reliable, offer.is_latched
    return route.bus, offer.kind, offer.hash, *is_, route.depth


def _never(_: bytes) -> None:
    """The callback that rclpy asks for; no executor calls it."""


def _producer(spec: Spec, info: Mapping[str, Any]) -> str | None:
    """What tells the producers of a latched topic apart, if anything does here.

    The daemon tells those of /tf_static apart by their frames.
    """
    if not spec.is_latched or spec.name.endswith(TF_STATIC):
        return None
    # Before Lyrical, rclpy does not say who sent a message.
    gid = info.get("publisher_gid")
    return None if gid is None else bytes(gid).hex()[:32]
