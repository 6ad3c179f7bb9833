"""The bridge: what the daemon hears and says for Foxglove, and commands from there."""

import asyncio
import logging
from collections.abc import Callable, Sequence

import msgspec
from foxglove import Channel, Context
from foxglove.websocket import StatusLevel

from sdrlinkd.client import Message
from sdrlinkd.daemon_side import DaemonSide
from sdrlinkd.errors import ungrouped
from sdrlinkd.foxglove.channels import ReceivedTopics
from sdrlinkd.foxglove.door import Door, Rules
from sdrlinkd.foxglove.operators import Operators
from sdrlinkd.foxglove.report import BridgeReport
from sdrlinkd.foxglove.scene import Scene
from sdrlinkd.foxglove.server import SlowClients, start_server
from sdrlinkd.json_schema import json_schema
from sdrlinkd.reports import Snapshot

STATUS, BRIDGE = "/sdrlink/status", "/sdrlink/bridge"

_log = logging.getLogger(__name__)


class Bridge:
    """One daemon's topics, state and robots, for clients that come through the door."""

    def __init__(self, directory: str | None, patterns: Sequence[str], rules: Rules) -> None:
        self._daemon = DaemonSide(directory)
        self._context = context = Context()
        self._topics = ReceivedTopics(context)
        self._scene = Scene(context)
        self._status = Channel(STATUS, schema=json_schema(Snapshot), context=context)
        self._about = Channel(BRIDGE, schema=json_schema(BridgeReport), context=context)
        self._slow = SlowClients()
        self._operators = Operators(
            patterns, rules.secret, self._say, self._daemon.publish, self._topics.again
        )
        self._server = start_server(context, self._operators)
        self.door = Door(rules, self._server.port)

    async def run(self, topics: Sequence[str]) -> None:
        """Work until cancelled; `topics` as for a subscriber. Raises UserError."""
        try:
            async with self._daemon.publisher() as out, asyncio.TaskGroup() as group:
                group.create_task(self._daemon.listen(self._take, topics))
                group.create_task(self._daemon.look(self._see))
                group.create_task(self._operators.send_all(out))
        finally:
            self.door.close()
            self._daemon.close()
            await asyncio.to_thread(self._server.stop)
            self._slow.close()

    def report(self) -> BridgeReport:
        """The bridge at this moment."""
        return BridgeReport(
            has_daemon=self._daemon.snapshot is not None,
            topics=len(self._topics),
            passed=self._topics.passed,
            not_shown=self._topics.not_shown,
            unreadable=self._scene.unreadable,
            slow=self._slow.count,
            clients_refused=self.door.refused,
            commands_sent=self._operators.sent,
            commands_refused=self._operators.refused,
            commands_outdated=self._operators.outdated,
        )

    def _take(self, message: Message) -> None:
        self._topics.take(message)
        self._scene.take(message)

    def _see(self, snapshot: Snapshot | None) -> None:
        self._operators.snapshot = snapshot
        if snapshot is not None:
            self._status.log(msgspec.json.encode(snapshot), log_time=snapshot.taken_at_unix_ns)
        self._about.log(msgspec.json.encode(self.report()))

    def _say(self, topic: str, sentence: str) -> None:
        """Show a sentence to all clients; a newer one for the topic takes its place."""
        self._server.publish_status(sentence, StatusLevel.Warning, f"publish {topic[:80]}")


async def run_bridge(
    directory: str | None, host: str, port: int, patterns: Sequence[str], topics: Sequence[str],
    rules: Rules, started: Callable[[int], None],
) -> None:  # fmt: skip
    """Run a bridge until cancelled; `started` is called with the port. Raises UserError.

    `patterns` name what clients may publish, such as `/robot_*/cmd_vel`, if the `rules` have a
    token. Port 0: any.
    """
    bridge = Bridge(directory, patterns, rules)
    started(await bridge.door.open(host, port))
    with ungrouped():
        await bridge.run(topics)
