"""From the radio to ROS: publishers, and a thread that feeds them with what the daemon hears."""

import threading
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from sdrlink_ros import graph, qos
from sdrlink_ros.echoes import Echoes
from sdrlink_ros.kinds import UnknownTypeError, kind
from sdrlink_ros.names import Names, command_for, is_command, matches, rate_of
from sdrlink_ros.outlet import LINGER_S, Outlet, Source, restamped
from sdrlink_ros.sayings import Sayings
from sdrlink_ros.settings import Settings
from sdrlinkd.client import Message, NoDaemonError, Subscriber

NOTHING = "/sdrlink_bridge"
"""A bus topic that no message has, as a subscriber needs one."""
POLL_S = 0.1
AWAY_S = 0.5
TF = ("tf", "tf_static")
HASH_DIGITS = 16
STOP_S = 2.0
GONE_S = 60.0
"""Time in s after which a topic goes that is neither declared nor subscribed to any more."""
MOST_OUTLETS = 2000


class Incoming:
    """Publishes the topics of other robots, and wants those that somebody here subscribes to.

    `node` is for publishers only. `take_inner` takes messages of topics that bridges use among
    themselves.
    """

    def __init__(
        self,
        node: Any,  # noqa: ANN401
        names: Names,
        directory: Path | None,
        echoes: Echoes,
        sayings: Sayings,
        take_inner: Callable[[Message], None],
    ) -> None:
        self._node = node
        self._names = names
        self._directory = directory
        self._echoes = echoes
        self._take_inner = take_inner
        self._sayings = sayings
        self._outlets: dict[str, Outlet] = {}
        self._lock = threading.RLock()
        """Held while publishers are made, used or destroyed."""
        self._fresh: SimpleQueue[str] = SimpleQueue()
        """Topics whose publishers are new, and lack what was kept."""
        self._wanted: frozenset[str] = frozenset()
        self._inner: frozenset[str] = frozenset()
        self._refused: dict[str, tuple[Source, str]] = {}
        """Topics that are not published, and why, by bus topic."""
        self.published: Counter[str] = Counter()
        """Messages published, by bus topic."""
        self.dropped: Counter[str] = Counter()
        """Messages not published, by reason."""
        self._is_over = False
        self._thread = threading.Thread(target=self._run, name="hearer", daemon=True)

    def start(self) -> None:
        """Begin to publish messages."""
        self._thread.start()

    def stop(self) -> None:
        """End the thread."""
        self._is_over = True
        self._thread.join(STOP_S)

    @property
    def outlets(self) -> Mapping[str, Outlet]:
        """The topics of other robots that appear here, by bus topic."""
        return self._outlets

    @property
    def refused(self) -> dict[str, str]:
        """Why topics of other robots are not published, in words by bus topic."""
        return {bus: text for bus, (_, text) in self._refused.items()}

    @property
    def wanted(self) -> frozenset[str]:
        """The bus topics that somebody here subscribes to."""
        return self._wanted

    def rates(self, settings: Settings) -> dict[str, float]:
        """How often messages of wanted topics are enough here, in Hz by bus topic."""
        found = {}
        for bus in self._wanted:
            outlet = self._outlets.get(bus)
            if outlet is None or outlet.is_command:
                continue
            hz = rate_of(outlet.names, settings.rates)
            if hz is not None:
                found[bus] = hz
        return found

    def heard(self) -> set[tuple[int, str]]:
        """(robot, name) of the topics that other robots declare."""
        return {(each.source.robot, each.source.name) for each in self._outlets.values()}

    def follow(self, sources: Iterable[Source], settings: Settings, inner: frozenset[str]) -> None:
        """Publish these topics. What is no longer declared stays: its robot may only restart.

        `inner` are the bus topics of bridges among themselves, which are always wanted.
        """
        self._inner = inner
        declared = set()
        for source in sources:
            declared.add(source.bus)
            known = self._outlets.get(source.bus)
            names = self._names_of(source, settings)
            if known is not None and known.source == source and known.names == names:
                known.is_restamped = self._is_restamped(source, known, settings)
                continue
            if source.bus in self._refused and self._refused[source.bus][0] == source:
                continue
            if known is not None:
                self._close(source.bus)
            if names:
                self._open(source, names, settings, known is not None)
        now = time.monotonic()
        for bus, outlet in self._outlets.items():
            is_gone = bus not in declared
            outlet.gone_at = (outlet.gone_at or now) if is_gone else None

    def look(self, taken: Mapping[str, Any], now: float, is_refused: bool) -> None:
        """Find out which topics somebody here subscribes to; `taken` are our own subscriptions.

        `is_refused`: nothing is to be published, so nothing is wanted.
        """
        if is_refused:
            self._wanted = frozenset()
            return
        for bus, outlet in list(self._outlets.items()):
            if outlet.gone_at is not None and now - max(outlet.gone_at, outlet.wanted_at) > GONE_S:
                self._close(bus)
                continue
            others = sum(
                publisher.get_subscription_count() - (name in taken)
                for (name, _), publisher in list(outlet.publishers.items())
            )
            if others > 0 or outlet.is_command:
                outlet.wanted_at = now
        wanted = (bus for bus, each in self._outlets.items() if now - each.wanted_at < LINGER_S)
        self._wanted = self._inner.union(wanted)

    def _names_of(self, source: Source, settings: Settings) -> tuple[str, ...]:
        """The names under which a topic appears here; none if it is not for this robot."""
        if is_command(source.name):
            name = command_for(self._names.own, source.name)
            return () if name is None else (self._command_here(name),)
        name = self._names.here(source.robot, source.name)
        is_merged = settings.tf_merge and source.name in TF
        return (name, f"/{source.name}") if is_merged else (name,)

    def _command_here(self, name: str) -> str:
        """The name of a command to this robot, with its prefix if its nodes listen only there."""
        prefixed = self._names.here(self._names.own, name[1:])
        count = self._node.count_subscribers
        return prefixed if count(prefixed) and not count(name) else name

    def _open(
        self, source: Source, names: tuple[str, ...], settings: Settings, is_again: bool
    ) -> None:
        if len(self._outlets) >= MOST_OUTLETS:
            self._refuse(source, f"{names[0]}: {MOST_OUTLETS} topics of others appear here already")
            return
        try:
            outlet = Outlet(source, kind(source.kind), names, is_command(source.name))
        except UnknownTypeError as error:
            self._refuse(source, f"{names[0]} of robot {source.robot}: {error}")
            return
        try:
            for name in names:
                self._publisher(outlet, name, 0)
        except Exception as error:  # a name or a type from the air must not end the others
            self._destroy(outlet)
            self._refuse(source, f"{names[0]} of robot {source.robot}, {source.kind}: {error}")
            return
        own = graph.own_hash(self._node, names[0]).removeprefix("RIHS01_")[:HASH_DIGITS]
        if own and source.hash and own != source.hash:
            self._destroy(outlet)
            self._refuse(
                source,
                f"{names[0]}: robot {source.robot} sends {source.kind} with hash {source.hash}, "
                f"but here it has {own}; install the same version of its package at both robots",
            )
            return
        outlet.is_restamped = self._is_restamped(source, outlet, settings)
        self._refused.pop(source.bus, None)
        if is_again:
            self._fresh.put(source.bus)
        self._outlets = {**self._outlets, source.bus: outlet}

    def _refuse(self, source: Source, text: str) -> None:
        if len(self._refused) >= MOST_OUTLETS:
            self._refused.clear()
        self._refused[source.bus] = source, text
        self._sayings.once(text)

    def _close(self, bus: str) -> None:
        outlets = dict(self._outlets)
        outlet = outlets.pop(bus)
        self._outlets = outlets
        self._destroy(outlet)

    def _destroy(self, outlet: Outlet) -> None:
        with self._lock:
            outlet.is_closed = True
            for publisher in outlet.publishers.values():
                self._node.destroy_publisher(publisher)
            outlet.publishers.clear()

    def _is_restamped(self, source: Source, outlet: Outlet, settings: Settings) -> bool:
        given = (f"/{source.name}", *outlet.names)
        is_named = any(matches(name, settings.restamp) for name in given)
        return is_named and outlet.kind.has_header

    def _publisher(self, outlet: Outlet, name: str, series: int) -> Any:  # noqa: ANN401
        """The publisher for messages of one producer of the source.

        Producers of latched topics are kept apart, so that late subscribers get the last message of
        each.
        """
        source = outlet.source
        key = name, series if source.kept else 0
        publisher = outlet.publishers.get(key)
        if publisher is None:
            profile = qos.publisher(source.kept > 0, source.is_best_effort, source.kept)
            publisher = self._node.create_publisher(outlet.kind.message, name, profile)
            outlet.publishers[key] = publisher
        return publisher

    # The thread.

    def _run(self) -> None:
        while not self._is_over:
            try:
                with Subscriber(NOTHING, runtime_dir=self._directory, timeout_s=1.0) as subscriber:
                    self._hear(subscriber)
            except NoDaemonError:  # noqa: PERF203
                # The bridge says that the daemon is away.
                time.sleep(AWAY_S)
            except Exception as error:
                if self._is_over or not self._node.context.ok():
                    break
                self._sayings.say(f"incoming topics are set up again, after an error: {error}")
                time.sleep(AWAY_S)

    def _hear(self, subscriber: Subscriber) -> None:
        subscribed: set[str] = set()
        while not self._is_over:
            wanted = self._wanted
            if wanted != subscribed:
                for bus in wanted - subscribed:
                    subscriber.subscribe(bus)
                for bus in subscribed - wanted:
                    subscriber.unsubscribe(bus)
                subscribed = set(wanted)
            while not self._fresh.empty():
                if (bus := self._fresh.get()) in subscribed:
                    subscriber.unsubscribe(bus)
                    subscriber.subscribe(bus)
            message = subscriber.receive(POLL_S)
            if message is None:
                continue
            try:
                self._publish(message)
            except Exception as error:  # one topic must not end the others
                self.dropped["publish_failed"] += 1
                if not self._is_over:
                    self._sayings.once(f"{message.topic}: not published: {error}")

    def _publish(self, message: Message) -> None:
        outlet, cdr = self._outlets.get(message.topic), message.payload
        if message.topic in self._inner:
            self._take_inner(message)
        elif outlet is None:
            self.dropped["rx_unknown_topic"] += 1
        elif message.type != outlet.kind.name:
            self.dropped["rx_other_type"] += 1
        elif not outlet.kind.fits(cdr):
            self.dropped["rx_bad_cdr"] += 1
        else:
            outlet.is_sealed = message.is_sealed
            if outlet.is_known(message):
                return
            if outlet.is_restamped and message.published_ns is not None:
                cdr = restamped(cdr, message.published_ns)
            with self._lock:
                if outlet.is_closed:
                    return
                for name in outlet.names:
                    publisher = self._publisher(outlet, name, message.series)
                    # Nodes here may publish on it, too, and then the bridge subscribes to it.
                    self._echoes.sent(name, cdr, outlet.source.kept > 0)
                    publisher.publish(cdr)
            self.published[message.topic] += 1
