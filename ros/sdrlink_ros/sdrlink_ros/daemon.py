"""The daemon as the bridge sees it: declarations, demand and status, on the control socket."""

import contextlib
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from sdrlinkd.client import ControlClient, NoDaemonError, RefusedError

ANSWER_S = 1.0
FIRST_WAIT_S = 0.25
LONGEST_WAIT_S = 5.0


class Demand(NamedTuple):
    """What other robots want of this one's topics, by bus topic.

    `boot` differs after each start of the daemon, and `version` when others' declarations change.
    """

    boot: str
    version: int
    wanted: frozenset[str]
    rated: frozenset[str]
    """Topics of others for which a program here has asked for a rate."""


class Daemon:
    """Asks the daemon, and waits longer and longer while it is away. `say` logs a sentence."""

    def __init__(self, directory: "Path | None", say: Callable[[str], None]) -> None:
        self._directory = directory
        self._say = say
        self._control: ControlClient | None = None
        self._wait_s, self._try_at = FIRST_WAIT_S, 0.0
        self._was_away = False
        self._busy_since: float | None = None
        """Since when the daemon has been too slow to answer; None: it answers."""
        self._demand: Demand | None = None
        self.node = 0
        """The robot's id; 0 until the daemon has answered."""

    def look(self, says: str) -> Demand | None:
        """The demand, the last one if the daemon is busy; None without one, which is said once.

        `says` is what `sdrlinkctl status` shows of the bridge.
        """
        told = self.ask("demand", {"says": says})
        if told is not None:
            wanted, rated = frozenset(told["wanted"]), frozenset(told["rated"])
            self._demand = Demand(told["boot"], told["version"], wanted, rated)
        elif self._busy_since is None:
            self._demand = None
        # A daemon that is busy still takes messages, and wants what it wanted.
        return self._demand

    def rate(self, bus: str, hz: float) -> str:
        """Ask another robot for no more than `hz` messages a second; why that was refused."""
        try:
            self.ask("rate", {"topic": bus, "hz": hz})
        except RefusedError as error:
            return str(error)
        return ""

    def undeclare(self, bus: str, kind: str) -> None:
        """Tell the daemon that no node here publishes a topic of this type any more."""
        with contextlib.suppress(RefusedError):
            self.ask("undeclare", {"name": bus, "type": kind})

    def declare(self, arguments: dict[str, Any]) -> int | None:
        """Declare a topic; its number, or None without a daemon. Raises RefusedError."""
        told = self.ask("declare", arguments)
        return None if told is None else int(told["number"])

    def ask(self, verb: str, arguments: "dict[str, Any] | None" = None) -> Any:  # noqa: ANN401
        """The answer to a verb; None without a daemon. Raises RefusedError."""
        control = self._control or self._connect()
        if control is None:
            return None
        try:
            return control.ask(verb, arguments)
        except NoDaemonError as error:
            self._gone(error)
            return None

    def close(self) -> None:
        """Close the connection."""
        if self._control is not None:
            self._control.close()
            self._control = None

    def _connect(self) -> "ControlClient | None":
        if time.monotonic() < self._try_at:
            return None
        try:
            self._control = ControlClient(self._directory, ANSWER_S)
            hello = self._control.ask("hello")
        except NoDaemonError as error:
            self._gone(error)
            return None
        if "demand" not in hello["verbs"]:
            raise RefusedError("unknown_verb", f"sdrlinkd {hello['version']} is too old; update it")
        self.node = hello["node"]
        if self._was_away:
            self._say(f"the daemon of robot {self.node} answers")
        self._wait_s, self._was_away = FIRST_WAIT_S, False
        if self._busy_since is not None:
            slow_s = time.monotonic() - self._busy_since
            self._busy_since = None
            self._say(
                f"the daemon answers again, after {slow_s:.1f} s; no message was lost by that"
            )
        return self._control

    def _gone(self, error: NoDaemonError) -> None:
        self.close()
        if error.is_busy and not self._was_away:
            if self._busy_since is None:
                self._busy_since = time.monotonic() - ANSWER_S
                self._say(
                    f"the daemon answers slowly (more than {ANSWER_S:g} s), as its computer is "
                    "busy; messages go on"
                )
            self._try_at = time.monotonic() + FIRST_WAIT_S
            return
        self._busy_since = None
        if not self._was_away:
            self._say(f"waiting for the daemon; messages are lost meanwhile: {error}")
        self._was_away = True
        self._try_at = time.monotonic() + self._wait_s
        self._wait_s = min(2 * self._wait_s, LONGEST_WAIT_S)
