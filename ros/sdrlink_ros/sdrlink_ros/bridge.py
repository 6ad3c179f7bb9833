"""The bridge: two nodes, three threads, and a timer that looks at ROS and at the radio."""

import hashlib
import socket
import sys
import time
from pathlib import Path
from typing import Any

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node

from sdrlink_ros import actions, directory, graph, report
from sdrlink_ros.daemon import Daemon, Demand
from sdrlink_ros.echoes import Echoes
from sdrlink_ros.incoming import Incoming
from sdrlink_ros.names import Names, unused
from sdrlink_ros.outgoing import Outgoing, Spec
from sdrlink_ros.outlet import Source
from sdrlink_ros.parameters import Parameters
from sdrlink_ros.routes import Routes, decide
from sdrlink_ros.sayings import Sayings
from sdrlink_ros.services import LOST_S, Services, calls_of
from sdrlink_ros.state import State
from sdrlinkd.calls import STATUS
from sdrlinkd.client import RefusedError, runtime_dir

LOOK_S = 0.25
"""Period in s of a look at the demand for topics, and at others' declarations."""
WHOLE_LOOKS = 4
"""Every so many looks, and when the graph changes, each topic is looked at, and the state told."""
SETTLED_LOOKS = 40
"""After so many looks, patterns that match nothing are named."""
BAD_SETUP = 2


class BridgeError(Exception):
    """The bridge cannot run here; the message says what to do."""


def run(arguments: list[str], directory: "str | None") -> int:
    """Run the bridge until it is stopped; returns the exit status of the process."""
    rclpy.init(args=arguments)
    bridge = None
    try:
        bridge = Bridge(None if directory is None else Path(directory))
        bridge.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except (BridgeError, RefusedError, ValueError) as error:
        print(f"sdrlink_ros: {error}", file=sys.stderr)  # noqa: T201
        return BAD_SETUP
    except Exception:
        # A signal ends rclpy in the middle of anything.
        if rclpy.ok():
            raise
    finally:
        if bridge is not None:
            bridge.close()
        rclpy.try_shutdown()
    return 0


class Bridge:
    """Brings the topics of this robot to the radio, and those of other robots to this graph.

    The node `sdrlink_bridge` has the parameters and the timer. The node `sdrlink_bridge_N` of robot
    N has the subscriptions and publishers; no executor spins it.
    """

    def __init__(self, directory: "Path | None") -> None:
        self._directory = directory
        self._node = Node(graph.BRIDGE)
        self._parameters = Parameters(self._node, self._changed)
        self._sayings = Sayings(self._node.get_logger().warning)
        self._daemon = Daemon(directory, self._sayings.say)
        self._looks = 0
        self._seen: tuple[Any, ...] = ()
        self._is_changed = True
        self._is_refused = False
        """Whether another robot's bridge is on this graph."""
        self._version: tuple[str, int] = ("", -1)
        self._routes = Routes({}, {}, {})
        self._sources: list[Source] = []
        self._of_actions: dict[str, Spec] = {}
        self._declared: set[str] = set()
        """Topics between bridges that the daemon knows."""
        self._parts: _Parts | None = None
        self._lock: socket.socket | None = None

    def spin(self) -> None:
        """Run until rclpy shuts down. Raises BridgeError if another bridge serves the daemon."""
        executor = SingleThreadedExecutor()
        executor.add_node(self._node)
        self._look()
        self._node.create_timer(LOOK_S, self._look)
        executor.spin()

    def close(self) -> None:
        """Stop the threads, and leave the graph."""
        if self._parts is not None:
            self._parts.close()
        self._daemon.close()
        self._node.destroy_node()
        if self._lock is not None:
            self._lock.close()

    def _look(self) -> None:
        demand = self._daemon.look(self._in_words())
        if self._parts is None:
            if not self._daemon.node:
                return
            self._lock = _locked(self._directory)
            names = Names(self._daemon.node, self._parameters.settings.rx_format)
            self._parts = _Parts(names, self._directory, self._node, self._sayings)
        parts, settings, now = self._parts, self._parameters.settings, time.monotonic()
        seen = parts.seen()
        is_due = self._looks % WHOLE_LOOKS == 0
        is_changed, self._is_changed = self._is_changed, False
        is_whole = is_due or is_changed or seen != self._seen
        if demand is not None and (demand.boot, demand.version) != self._version:
            is_whole = self._learn(parts, demand) or is_whole
        if is_whole:
            self._seen = seen
            self._look_at_graph(parts)
            if demand is not None:
                parts.outgoing.follow(self._routes.taken, self._daemon, demand.boot)
                self._look_at_services(parts)
        wanted = frozenset() if demand is None else demand.wanted
        parts.outgoing.want(self._routes.taken, wanted, self._of_actions, now)
        parts.incoming.look(parts.outgoing.taker.taps, now, self._is_refused)
        if is_due and demand is not None:
            self._ask_rates(parts, demand.rated)
        if is_due and parts.state.is_wanted:
            snapshot = self._daemon.ask("status") if demand is not None else None
            told = report.topics(self._routes, parts.outgoing, parts.incoming, parts.services)
            parts.state.tell(self._daemon.node, snapshot, told)
        self._looks += 1
        if self._looks == SETTLED_LOOKS:
            self._say_unused(settings)

    def _ask_rates(self, parts: "_Parts", rated: "frozenset[str]") -> None:
        """Ask others for no more messages than the parameter says are enough.

        Of topics that another program here has `rated`, it asks for all where nothing is said.
        """
        asked = parts.incoming.rates(self._parameters.settings)
        asked |= dict.fromkeys((parts.incoming.wanted & rated) - asked.keys(), 0.0)
        for bus, hz in asked.items():
            refused = self._daemon.rate(bus, hz)
            if refused:
                self._sayings.once(f"rates: {refused}")

    def _look_at_graph(self, parts: "_Parts") -> None:
        """Decide anew what becomes of the topics of this graph, and of those of other robots."""
        own = self._daemon.node
        others = graph.other_bridges(parts.data, own)
        if bool(others) != self._is_refused:
            self._is_refused = bool(others)
            self._sayings.say(
                f"refused: the bridges of robots {own} and {', '.join(map(str, others))} see each "
                "other over DDS, so messages would go round; give each robot a ROS_DOMAIN_ID of "
                "its own, or set ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST"
                if others
                else "no other bridge is on this graph any more: topics are sent again"
            )
        inner = {each.bus for each in self._sources if parts.services.hears(each)}
        topics = (each for each in self._sources if each.bus not in inner)
        parts.incoming.follow(topics, self._parameters.settings, frozenset(inner))
        # The names of a graph that two robots share say nothing about who publishes.
        offers = {} if others else graph.offers(parts.data)
        self._routes = decide(
            offers, self._parameters.settings, parts.names, parts.incoming.heard()
        )
        for text in self._routes.refused.values():
            self._sayings.once(text)

    def _learn(self, parts: "_Parts", demand: Demand) -> bool:
        """Learn which topics other robots declare; False if the daemon does not answer."""
        told = self._daemon.ask("declared")
        if told is None:
            return False
        if demand.boot != self._version[0]:
            self._declared.clear()
            parts.services.tell_again()
        self._sources = [Source.told(each) for each in told]
        self._version = demand.boot, demand.version
        return True

    def _look_at_services(self, parts: "_Parts") -> None:
        """Offer the services of this robot, and see whose robots have fallen silent."""
        settings, services = self._parameters.settings, parts.services
        patterns = () if self._is_refused else settings.services_allow
        found = directory.found(parts.data, parts.names, patterns)
        for text in found.refused.values():
            self._sayings.once(text)
        services.offer(found.services, settings.services_timeout_s)
        for arguments in services.declarations(self._sources):
            name = str(arguments["name"])
            if name not in self._declared and self._is_declared(arguments):
                self._declared.add(name)
        robots = {each.robot for each in self._sources}
        services.reach(frozenset(each for each in robots if calls_of(each) in self._declared))
        has_inner = f"/{STATUS}" in self._declared
        self._of_actions = actions.specs(found.services) if has_inner else {}
        if services.has_proxies:
            peers = self._daemon.ask("peers") or []
            silent = (each["src"] for each in peers if each["last_heard_s_ago"] > LOST_S)
            services.silent(frozenset(silent))

    def _is_declared(self, arguments: dict[str, Any]) -> bool:
        """Declare a topic for calls; False if the daemon is away, or refuses it."""
        try:
            return self._daemon.declare(arguments) is not None
        except RefusedError as error:
            self._sayings.once(f"calls and services: {error}")
            return False

    def _changed(self) -> None:
        self._is_changed = True

    def _in_words(self) -> str:
        """The bridge in one sentence."""
        if self._parts is None:
            return "ROS bridge: starting"
        if self._is_refused:
            return "ROS bridge: refused, as another robot's bridge is on its DDS graph; see its log"
        return report.in_words(self._routes, self._parts.outgoing, self._parts.incoming)

    def _say_unused(self, settings: Any) -> None:  # noqa: ANN401
        known = [*self._routes.taken, *self._routes.left_out]
        given = {"allow": settings.allow, "deny": settings.deny, "eager": settings.eager}
        for parameter, patterns in given.items():
            for pattern, near in unused(patterns, known).items() if known else ():
                hint = f"; the nearest are {', '.join(near)}" if near else ""
                self._sayings.once(f"{parameter}: {pattern} matches no topic here so far{hint}")


class _Parts:
    """What needs the robot's id, which the daemon knows."""

    def __init__(
        self,
        names: Names,
        folder: "Path | None",
        node: Node,
        sayings: Sayings,
    ) -> None:
        self.names = names
        echoes = Echoes()
        self.data = Node(
            f"{graph.BRIDGE}_{names.own}",
            use_global_arguments=False,
            enable_rosout=False,
            start_parameter_services=False,
        )
        self.outgoing = Outgoing(self.data, folder, echoes, sayings)
        self.services = Services(self.data, names, folder, sayings)
        self.incoming = Incoming(self.data, names, folder, echoes, sayings, self.services.hear)
        self.state = State(node, echoes)
        self.outgoing.taker.start()
        self.incoming.start()
        self.services.start()
        node.get_logger().info(f"bridge of robot {names.own}")

    def seen(self) -> tuple[Any, ...]:
        """What changes with the ROS graph, and costs little to look at."""
        data = self.data
        return data.get_node_names_and_namespaces(), data.get_topic_names_and_types()

    def close(self) -> None:
        self.outgoing.taker.stop()
        self.incoming.stop()
        self.services.stop()
        self.data.destroy_node()


def _locked(directory: "Path | None") -> socket.socket:
    """A lock that a second bridge of the same daemon does not get. Raises BridgeError.

    It is an abstract socket: it needs no right to write, and ends with this process.
    """
    path = runtime_dir(directory).resolve()
    lock = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    digest = hashlib.sha256(str(path).encode()).hexdigest()
    try:
        lock.bind(f"\0sdrlink_bridge_{digest[:32]}")
    except OSError:
        lock.close()
        raise BridgeError(
            f"another bridge already serves the daemon in {path}; stop it first"
        ) from None
    return lock
