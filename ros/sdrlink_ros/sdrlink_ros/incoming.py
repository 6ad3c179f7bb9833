"""From the radio to ROS: publishers, and a thread that feeds them with what the daemon hears."""

import struct
import threading
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from sdrlink_ros import graph, qos
from sdrlink_ros.echoes import Echoes
from sdrlink_ros.kinds import Kind, UnknownTypeError, kind
from sdrlink_ros.names import Names, command_for, is_command, matches
from sdrlink_ros.settings import Settings
from sdrlinkd.client import EnvelopeMismatchError, Message, NoDaemonError, Subscriber

NOTHING = "/sdrlink_bridge"
"""A bus topic that no message has, as a subscriber needs one."""
POLL_S = 0.1
AWAY_S = 0.5
LINGER_S = 5.0
"""Time in s for which the demand for a topic lasts after its last subscriber here has gone."""
TF = ("tf", "tf_static")
HASH_DIGITS = 16
STOP_S = 2.0
_LITTLE, _BIG = struct.Struct("<iI"), struct.Struct(">iI")
SECOND_NS = 1_000_000_000


class Source(NamedTuple):
    """A topic that another robot declares; `kept` messages of it are kept for late joiners."""

    robot: int
    name: str
    kind: str
    hash: str
    kept: int
    is_best_effort: bool
    bus: str

    @classmethod
    def told(cls, fields: Mapping[str, Any]) -> "Source":
        """A topic as the daemon tells it."""
        return cls(
            fields["robot"], fields["name"], fields["type"], fields["hash"], fields["latched"],
            fields["best_effort"], fields["topic"],
        )  # fmt: skip


class Outlet:
    """The publishers of a topic of another robot, by name here and series of the source.

    `is_command`: it commands this robot, so it is wanted whether anybody subscribes or not.
    """

    def __init__(
        self, source: Source, kind_: Kind, names: tuple[str, ...], is_command_: bool
    ) -> None:
        self.source = source
        self.kind = kind_
        self.names = names
        self.is_command = is_command_
        self.is_restamped = False
        self.publishers: dict[tuple[str, int], Any] = {}
        self.wanted_at = -LINGER_S


class Incoming:
    """Publishes the topics of other robots, and wants those that somebody here subscribes to.

    `node` is for publishers only. `say` logs a sentence. `take_inner` takes messages of topics that
    bridges use among themselves.
    """

    def __init__(
        self,
        node: Any,  # noqa: ANN401
        names: Names,
        directory: Path | None,
        echoes: Echoes,
        say: Callable[[str], None],
        take_inner: Callable[[Message], None],
    ) -> None:
        self._node = node
        self._names = names
        self._directory = directory
        self._echoes = echoes
        self._take_inner = take_inner
        self._say = say
        self._outlets: dict[str, Outlet] = {}
        self._wanted: frozenset[str] = frozenset()
        self._inner: frozenset[str] = frozenset()
        self._refused_sources: dict[str, Source] = {}
        self.refused: dict[str, str] = {}
        """Why a topic of another robot is not published, in words by bus topic."""
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
    def has_commands(self) -> bool:
        """Whether other robots command this one; their names here depend on who subscribes."""
        return any(each.is_command for each in self._outlets.values())

    @property
    def wanted(self) -> frozenset[str]:
        """The bus topics that somebody here subscribes to."""
        return self._wanted

    def heard(self) -> set[tuple[int, str]]:
        """(robot, name) of the topics that other robots declare."""
        return {(each.source.robot, each.source.name) for each in self._outlets.values()}

    def follow(self, sources: Iterable[Source], settings: Settings, inner: frozenset[str]) -> None:
        """Publish these topics. What is no longer declared stays: its robot may only restart.

        `inner` are the bus topics of bridges among themselves, which are always wanted.
        """
        self._inner = inner
        for source in sources:
            known = self._outlets.get(source.bus)
            names = self._names_of(source, settings)
            if known is not None and known.source == source and known.names == names:
                known.is_restamped = self._is_restamped(source, known, settings)
                continue
            if self._refused_sources.get(source.bus) == source:
                continue
            if known is not None:
                self._close(source.bus)
            if names:
                self._open(source, names, settings)

    def look(self, taken: Mapping[str, Any], now: float, is_refused: bool) -> None:
        """Find out which topics somebody here subscribes to; `taken` are our own subscriptions.

        `is_refused`: nothing is to be published, so nothing is wanted.
        """
        if is_refused:
            self._wanted = frozenset()
            return
        wanted = (bus for bus, each in self._outlets.items() if now - each.wanted_at < LINGER_S)
        for outlet in self._outlets.values():
            others = sum(
                publisher.get_subscription_count() - (name in taken)
                for (name, _), publisher in list(outlet.publishers.items())
            )
            if others > 0 or outlet.is_command:
                outlet.wanted_at = now
        self._wanted = frozenset(wanted) | self._inner

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

    def _open(self, source: Source, names: tuple[str, ...], settings: Settings) -> None:
        try:
            outlet = Outlet(source, kind(source.kind), names, is_command(source.name))
        except UnknownTypeError as error:
            self._refuse(source, f"{names[0]} of robot {source.robot}: {error}")
            return
        for name in names:
            self._publisher(outlet, name, 0)
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
        self._refused_sources.pop(source.bus, None)
        self.refused.pop(source.bus, None)
        self._outlets = {**self._outlets, source.bus: outlet}

    def _refuse(self, source: Source, text: str) -> None:
        self._refused_sources[source.bus] = source
        if self.refused.get(source.bus) != text:
            self.refused[source.bus] = text
            self._say(text)

    def _close(self, bus: str) -> None:
        outlets = dict(self._outlets)
        outlet = outlets.pop(bus)
        self._outlets = outlets
        self._destroy(outlet)

    def _destroy(self, outlet: Outlet) -> None:
        for publisher in outlet.publishers.values():
            self._node.destroy_publisher(publisher)

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
            except (NoDaemonError, EnvelopeMismatchError):  # noqa: PERF203
                # The bridge says that the daemon is away.
                threading.Event().wait(AWAY_S)

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
            message = subscriber.receive(POLL_S)
            if message is None:
                continue
            try:
                self._publish(message)
            except Exception as error:  # one topic must not end the others
                self.dropped["publish_failed"] += 1
                if not self._is_over and self.dropped["publish_failed"] == 1:
                    self._say(f"{message.topic}: not published: {error}")

    def _publish(self, message: Message) -> None:
        outlet, cdr = self._outlets.get(message.topic), message.payload
        if message.topic in self._inner:
            self._take_inner(message)
        elif outlet is None:
            self.dropped["rx_unknown_topic"] += 1
        elif message.type != outlet.kind.name:
            self.dropped["rx_other_type"] += 1
        elif len(cdr) < outlet.kind.least or cdr[:2] not in (b"\0\0", b"\0\1"):
            self.dropped["rx_bad_cdr"] += 1
        else:
            if outlet.is_restamped and message.published_ns is not None:
                cdr = restamped(cdr, message.published_ns)
            for name in outlet.names:
                publisher = self._publisher(outlet, name, message.series)
                # Nodes here may publish on this name, too, and then the bridge subscribes to it.
                self._echoes.sent(name, cdr)
                publisher.publish(cdr)
            self.published[message.topic] += 1


def restamped(cdr: bytes, time_ns: int) -> bytes:
    """A message with `time_ns`, in ns since 1970, as the stamp of its std_msgs/Header."""
    form = _LITTLE if cdr[1] & 1 else _BIG
    return cdr[:4] + form.pack(*divmod(time_ns, SECOND_NS)) + cdr[4 + form.size :]
