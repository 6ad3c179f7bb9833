"""Opens, runs and stops one node. Knows all parts and holds no algorithm."""

import asyncio
import contextlib
import gc
import logging
import os
import signal
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING, Any

import zmq

from sdrlinkd import __version__
from sdrlinkd.bus import Bus, RuntimeDirectory
from sdrlinkd.client import runtime_dir
from sdrlinkd.config import Config, Setup
from sdrlinkd.control import Control, Verb
from sdrlinkd.errors import ConfigError, UserError
from sdrlinkd.link import Link, Told
from sdrlinkd.node import Node
from sdrlinkd.pdulink import DirectLink, PduLink, make_gnuradio
from sdrlinkd.policies import Policies
from sdrlinkd.sdnotify import Notifier

if TYPE_CHECKING:
    # Loading it brings recordings, of which a daemon of a real robot has none.
    from sdrlinkd.adapters import ChronySocket, Due, Transforms

log = logging.getLogger("sdrlinkd")

STATUS_LINE_PERIOD_S = 5.0
SWITCH_INTERVAL_S = 1e-4

Reload = Callable[[], Setup]


async def run(setup: Setup, reload: Reload) -> None:
    """Run the node of `setup` until SIGTERM or SIGINT.

    `reload` reads the configuration anew, for SIGHUP. Raises UserError when the node cannot be
    opened.
    """
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGTERM, signal.SIGINT):
        loop.add_signal_handler(number, stop.set)
    notifier = Notifier()
    async with contextlib.AsyncExitStack() as stack:
        node, control, policies = await _open(setup, stack, reload)
        loop.add_signal_handler(signal.SIGHUP, _reload_on_signal, policies, setup, reload)
        stack.callback(loop.remove_signal_handler, signal.SIGHUP)
        async with asyncio.TaskGroup() as tasks:
            running = [
                tasks.create_task(node.carry(), name="carry"),
                tasks.create_task(node.tick(), name="tick"),
                tasks.create_task(_notify(notifier, node, control), name="notify"),
            ]
            notifier.ready()
            await stop.wait()
            log.info("stopping: %d messages queued", node.snapshot(0).link.tx.queued)
            notifier.stopping()
            await node.drain(setup.config.drain_s)
            for task in running:
                task.cancel()
        for problem in node.audit():
            log.error("ledger: %s", problem)
        log.info("stopped: %s", status_line(node, control))


async def _open(
    setup: Setup, stack: contextlib.AsyncExitStack, reload: Reload
) -> tuple[Node, Control, Policies]:
    config = setup.config
    rng = Random(os.urandom(16) if config.seed is None else config.seed)
    directory = RuntimeDirectory(_runtime_directory(config))
    stack.callback(directory.close)
    link = Link(
        config.link,
        config.queue,
        config.reassembly,
        setup.registry,
        setup.node_id,
        rng,
        classes=config.classes,
        relay=config.relay,
        clock=config.clock,
        dictionaries=setup.dictionaries,
        hears_self=config.hears_self,
        max_expanded=config.bus.max_message_bytes,
    )
    policies = Policies(setup, link)
    pdu_link = _make_pdu_link(setup, rng)
    context = zmq.Context()
    # Closes what a part that failed half-way left open; term() would wait for it for ever.
    stack.callback(context.destroy)
    headers, stops = _types_of(setup)
    open_bus = partial(Bus, context, directory, setup)
    chrony = _chrony(setup, stack)
    node = Node(setup, link, pdu_link, open_bus, _transforms(setup), headers, stops, chrony)
    stack.callback(node.bus.close)
    control = Control(context, directory)
    stack.callback(control.close)
    control.serve(_verbs(setup, node, control, policies, reload))
    stack.push_async_callback(pdu_link.close)
    await node.open_carrier()
    # What is loaded stays; to look through all of it would hold up everything for 50 ms.
    gc.collect()
    gc.freeze()
    if config.play.duration_s:
        node.play(_own_traffic(setup, stack))
    log.info(
        "sdrlinkd %s: robot %d on %s, %d topics, sockets in %s",
        __version__, setup.node_id, config.backend, len(setup.topics_in), directory.path,
    )  # fmt: skip
    log.info("access %s", link.departures.settled.sentence)
    for warning in setup.warnings:
        log.warning("%s", warning)
    return node, control, policies


def _make_pdu_link(setup: Setup, rng: Random) -> PduLink:
    config = setup.config
    if config.backend == "direct":
        return DirectLink(config.direct, config.link.pdu_size, rng)
    if config.backend == "gnuradio":
        return make_gnuradio(config)
    # Else a busy event loop keeps the modem's threads from the interpreter for 5 ms at a time.
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    # The modem brings numba, which takes its time to load.
    from sdrlinkd.modem import make_modem

    return make_modem(config, setup.node_id, rng)


def _types_of(setup: Setup) -> tuple[frozenset[int], dict[int, bytes]]:
    """(topics with a header, stop messages by topic id)."""
    # They bring the message types.
    from sdrlinkd.adapters import header_topics, stop_messages

    return header_topics(setup), stop_messages(setup)


def _chrony(setup: Setup, stack: contextlib.AsyncExitStack) -> "ChronySocket | None":
    from sdrlinkd.adapters import ChronySocket

    if not setup.config.chrony.socket:
        return None
    chrony = ChronySocket(Path(setup.config.chrony.socket))
    stack.callback(chrony.close)
    return chrony


def check(setup: Setup) -> list[str]:
    """What only the message types and the radio's nature can tell. Raises ConfigError."""
    _types_of(setup)
    # The modem brings numba, which takes its time to load.
    from sdrlinkd.modem import access_words

    try:
        return access_words(setup.config, setup.node_id)
    except ConfigError as error:
        raise ConfigError(f"{setup.source}: {error}") from None


def _transforms(setup: Setup) -> dict[int, "Transforms"]:
    if not setup.transforms:
        return {}
    # It brings the message types.
    from sdrlinkd.adapters import Transforms

    return {topic_id: Transforms(setup.config.tf) for topic_id in setup.transforms}


def _own_traffic(setup: Setup, stack: contextlib.AsyncExitStack) -> Iterator["Due"]:
    # Recordings bring much that a daemon of a real robot never needs.
    from sdrlinkd.adapters import BuiltInRobot, due_messages, open_bag

    config, play = setup.config, setup.config.play
    recording = (
        open_bag(Path(play.bag))
        if play.bag
        else BuiltInRobot(config.namespace, play.duration_s, config.seed or 0)
    )
    stack.callback(recording.close)
    return due_messages(recording, play.duration_s, play.begin_s, setup.topics_in)


def _runtime_directory(config: Config) -> Path:
    # systemd's RuntimeDirectory= may name several, the first is ours.
    given = config.bus.runtime_dir or os.environ.get("RUNTIME_DIRECTORY", "").split(":")[0]
    return runtime_dir(given or None)


def _verbs(
    setup: Setup, node: Node, control: Control, policies: Policies, reload: Reload
) -> dict[str, Verb]:
    def hello(_: dict[str, Any]) -> object:
        return {
            "daemon": "sdrlinkd",
            "version": __version__,
            "node": setup.node_id,
            "verbs": {name: verb.help for name, verb in verbs.items()},
        }

    def reload_policies(_: dict[str, Any]) -> object:
        _reload_policies(policies, setup, reload)
        log.info("topic policies re-read on request")
        return {"reloaded": "topic policies", "unchanged": "all other keys need a restart"}

    def set_policy(arguments: dict[str, Any]) -> object:
        changes = {key: value for key, value in arguments.items() if key != "topic"}
        if not changes:
            raise UserError("set: nothing to change; name at least one key")
        return policies.set(str(arguments.get("topic", "")), changes)

    def why(arguments: dict[str, Any]) -> object:
        topic_id = policies.topic_id(str(arguments.get("topic", "")))
        told = Told(setup.source, policies.changed.get(topic_id, ()))
        return {"why": node.why(topic_id, told)}

    verbs = {
        "hello": Verb(hello, "who answers, and what it can do"),
        "status": Verb(lambda _: node.snapshot(control.requests), "the whole snapshot"),
        "topics": Verb(lambda _: node.snapshot(control.requests).link.topics, "topics sent"),
        "peers": Verb(lambda _: node.snapshot(control.requests).link.neighbors, "who is heard"),
        "config": Verb(lambda _: setup.config, "the configuration in force"),
        "check": Verb(
            lambda _: {"problems": node.audit(), "ledger": node.snapshot(control.requests).link},
            "whether the ledger adds up",
        ),
        "why": Verb(why, "what happens to a topic, in plain words"),
        "set": Verb(set_policy, "change a topic's policy", changes=True),
        "reload": Verb(reload_policies, "read the topic policies anew", changes=True),
    }
    return verbs


def _reload_policies(policies: Policies, setup: Setup, reload: Reload) -> None:
    """Apply the policies of the configuration as it is now. Raises UserError, changing nothing."""
    changed = reload()
    if changed.registry.digest() != setup.registry.digest():
        raise UserError("the topic registry has changed, and topic ids with it; restart the daemon")
    policies.reload(changed.policies)


def _reload_on_signal(policies: Policies, setup: Setup, reload: Reload) -> None:
    try:
        _reload_policies(policies, setup, reload)
    except UserError as error:
        log.error("not reloaded, the old policies stay: %s", error)  # noqa: TRY400
    else:
        log.info("topic policies re-read; all other keys need a restart")


async def _notify(notifier: Notifier, node: Node, control: Control) -> None:
    """Feed the watchdog from the event loop, and keep the status line fresh; for ever."""
    period_s = STATUS_LINE_PERIOD_S
    if notifier.watchdog_s:
        period_s = min(period_s, notifier.watchdog_s / 3)
    while True:
        notifier.alive()
        notifier.status(status_line(node, control))
        await asyncio.sleep(period_s)


def status_line(node: Node, control: Control) -> str:
    """One line for systemd and the log."""
    snapshot = node.snapshot(control.requests)
    tx, rx = snapshot.link.tx, snapshot.link.rx
    return (
        f"{snapshot.carrier.kind} {snapshot.carrier.state}; "
        f"out {tx.sent}/{tx.accepted} sent, {tx.queued} queued, "
        f"{sum(tx.dropped.values())} dropped; "
        f"in {rx.delivered} delivered, {len(snapshot.link.neighbors)} robots heard"
    )
