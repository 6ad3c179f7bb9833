"""Opens, runs and stops one node: it connects all parts and contains no algorithm."""

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
from typing import TYPE_CHECKING

import zmq

from backends import Patience
from sdrlinkd import __version__
from sdrlinkd.bus import Bus, RuntimeDirectory
from sdrlinkd.client import runtime_dir
from sdrlinkd.config import WITHOUT_AIR, Config, Setup, backend_of, located
from sdrlinkd.control import Control
from sdrlinkd.declaring import Declaring
from sdrlinkd.descriptors import Descriptors
from sdrlinkd.errors import ConfigError, ungrouped
from sdrlinkd.health import first_line
from sdrlinkd.keeping import open_keeping
from sdrlinkd.link import Link
from sdrlinkd.modem import Loading, access_words, check_airtime, make_modem
from sdrlinkd.node import Node
from sdrlinkd.opening import Opening
from sdrlinkd.pdulink import DirectLink, PduLink, make_gnuradio
from sdrlinkd.policies import Policies
from sdrlinkd.reloading import Reloading
from sdrlinkd.reports import Snapshot
from sdrlinkd.sdnotify import Notifier
from sdrlinkd.sealing import Sealing
from sdrlinkd.spawn import EarlyModem
from sdrlinkd.verbs import make_verbs

if TYPE_CHECKING:
    # Its package imports the bag readers, which the daemon on a robot does not need.
    from sdrlinkd.adapters import ChronySocket, Due, MessageTypes, Transforms

log = logging.getLogger("sdrlinkd")

WATCH_PERIOD_S = 1.0
SWITCH_INTERVAL_S = 1e-4
START_S = 120.0
"""Longest time in s that startup may take, for small computers."""
STOP_S = 30.0
"""Longest time in s to release a radio or to finish compiling a kernel."""

Reload = Callable[[], Setup]


async def run(setup: Setup, reload: Reload, early: EarlyModem, descriptors: int) -> None:
    """Run the node of `setup` until SIGTERM or SIGINT.

    On SIGHUP, `reload` reads the configuration again. `early` may hold a modem process.
    `descriptors` is how many may be open. Raises UserError when the node cannot be opened.
    """
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGTERM, signal.SIGINT):
        loop.add_signal_handler(number, stop.set)
    notifier = Notifier()
    async with contextlib.AsyncExitStack() as stack:
        notifier.extend(START_S)
        node, control, reloading, guard = await _open(setup, stack, reload, early, descriptors)
        loop.add_signal_handler(signal.SIGHUP, reloading.on_signal)
        stack.callback(signal.signal, signal.SIGHUP, signal.SIG_IGN)
        with ungrouped():
            async with asyncio.TaskGroup() as tasks:
                running = [
                    tasks.create_task(node.carry(), name="carry"),
                    tasks.create_task(node.tick(), name="tick"),
                    tasks.create_task(_watch(notifier, node, control), name="watch"),
                    tasks.create_task(guard.watch(), name="descriptors"),
                ]
                # The bus accepts messages from here on; the radio may appear later.
                notifier.ready()
                await stop.wait()
                log.info("stopping: %d messages queued", node.snapshot(0).link.tx.queued)
                notifier.stopping()
                notifier.extend(setup.config.drain_s + STOP_S)
                await node.drain(setup.config.drain_s)
                for task in running:
                    task.cancel()
        for problem in node.audit():
            log.error("ledger: %s", problem)
        log.info("stopped: %s", traffic_line(node.snapshot(control.requests)))


async def _open(
    setup: Setup, stack: contextlib.AsyncExitStack, reload: Reload, early: EarlyModem,
    descriptors: int,
) -> tuple[Node, Control, Reloading, Descriptors]:  # fmt: skip
    config = setup.config
    rng = Random(os.urandom(16) if config.seed is None else config.seed)
    directory = RuntimeDirectory(runtime_directory(config))
    stack.callback(directory.close)
    keeping = open_keeping(setup)
    if keeping is not None:
        stack.callback(keeping.close)
    link = link_of(setup, rng, keeping.sealing if keeping is not None else None)
    policies = Policies(setup, link)
    loading = Loading()
    make = partial(_make_pdu_link, rng, loading, early)
    radio = backend_of(config)
    notices_replug = radio is not None and radio.heeds_patience
    opening = Opening(setup, make, notices_replug, lambda: loading.told)
    context = zmq.Context()
    # Closes sockets that a failed part left open; term() would wait for them forever.
    stack.callback(context.destroy)
    types, transforms = _types_of(setup), _transforms(setup)
    open_bus = partial(Bus, context, directory, setup)
    chrony = _chrony(setup, stack)
    node = Node(setup, link, opening, open_bus, transforms, types, chrony, keeping)
    stack.callback(node.bus.close)
    policies.announce = node.bus.announce
    control = Control(context, directory)
    stack.callback(control.close)
    reloading = Reloading(setup, reload, check, policies, opening, keeping)
    declaring = Declaring(setup, link, policies, node.bus, transforms)
    guard = Descriptors(descriptors, node.bus.listen)
    control.serve(make_verbs(setup, node, control, policies, opening, reloading, declaring, guard))
    stack.push_async_callback(opening.close)
    stack.callback(loading.give_up)
    # All that is loaded so far stays: a collection would scan it and stall the daemon for 50 ms.
    gc.collect()
    gc.freeze()
    if config.play.duration_s:
        node.play(_own_traffic(setup, stack))
    log.info(
        "sdrlinkd %s: robot %d on %s, %d topics, sockets in %s",
        __version__, setup.node_id, config.backend, len(setup.topics_in), directory.path,
    )  # fmt: skip
    if keeping is None and config.backend not in WITHOUT_AIR:
        log.info("PDUs are in the clear: anybody in range can send commands (security.mode)")
    for warning in setup.all_warnings:
        log.warning("%s", warning)
    return node, control, reloading, guard


def link_of(setup: Setup, rng: Random, sealing: Sealing | None = None) -> Link:
    """The link of a robot with these settings."""
    config = setup.config
    return Link(
        config.link,
        config.queue,
        config.reassembly,
        setup.registry,
        setup.node_id,
        rng,
        classes=config.classes,
        relay=config.relay,
        repeat=config.repeat,
        admission=config.admission,
        clock=config.clock,
        dictionaries=setup.dictionaries,
        hears_self=config.hears_self,
        has_numbers=setup.has_numbers,
        max_expanded=config.bus.max_message_bytes,
        sealing=sealing,
    )


def _make_pdu_link(
    rng: Random,
    loading: Loading,
    early: EarlyModem,
    setup: Setup,
    patience: Patience,
    began_s: float,
) -> PduLink:
    config = setup.config
    if config.backend == "direct":
        return DirectLink(config.direct, config.link.pdu_size, rng)
    if config.backend == "gnuradio":
        return make_gnuradio(config)
    # With the default, a busy event loop keeps a modem in this process waiting for 5 ms.
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    return make_modem(config, setup.node_id, rng, patience, began_s, loading, early)


def _types_of(setup: Setup) -> "MessageTypes":
    """What is known of the topics' types. Raises ConfigError."""
    # This imports the message types, which are slow to load.
    from sdrlinkd.adapters import MessageTypes

    return MessageTypes(setup)


def _chrony(setup: Setup, stack: contextlib.AsyncExitStack) -> "ChronySocket | None":
    from sdrlinkd.adapters import ChronySocket

    if not setup.config.chrony.socket:
        return None
    chrony = ChronySocket(Path(setup.config.chrony.socket))
    stack.callback(chrony.close)
    return chrony


def check(setup: Setup) -> list[str]:
    """Lines for the user from checks of message types and radio. Raises ConfigError."""
    _types_of(setup)
    try:
        if setup.config.backend not in WITHOUT_AIR:
            check_airtime(setup.config)
        return access_words(setup.config, setup.node_id)
    except ConfigError as error:
        raise ConfigError(located(str(error), setup.source)) from None


def _transforms(setup: Setup) -> dict[int, "Transforms"]:
    if not setup.transforms:
        return {}
    # This imports the message types, which are slow to load.
    from sdrlinkd.adapters import Transforms

    topics = setup.registry.topics
    return {
        each.id: Transforms(setup.config.tf) for each in topics if each.name in setup.transforms
    }


def _own_traffic(setup: Setup, stack: contextlib.AsyncExitStack) -> Iterator["Due"]:
    # The bag readers import much that the daemon on a robot never needs.
    from sdrlinkd.adapters import BuiltInRobot, due_messages, open_bag

    config, play = setup.config, setup.config.play
    recording = (
        open_bag(Path(play.bag))
        if play.bag
        else BuiltInRobot(config.namespace, play.duration_s, config.seed or 0)
    )
    stack.callback(recording.close)
    return due_messages(recording, play.duration_s, play.begin_s, setup.topics_in)


def runtime_directory(config: Config) -> Path:
    """The directory of the daemon's sockets: configured, or systemd's, or the user's."""
    # systemd's RuntimeDirectory= may name several; the first one is ours.
    given = config.bus.runtime_dir or os.environ.get("RUNTIME_DIRECTORY", "").split(":")[0]
    return runtime_dir(given or None)


async def _watch(notifier: Notifier, node: Node, control: Control) -> None:
    """Feed the watchdog, update the status line and log changes of health, forever.

    It runs on the event loop, so a blocked loop does not feed the watchdog.
    """
    period_s = WATCH_PERIOD_S
    if notifier.watchdog_s:
        period_s = min(period_s, notifier.watchdog_s / 3)
    while True:
        notifier.alive()
        snapshot = node.snapshot(control.requests)
        for line in node.health.look(snapshot):
            log.log(line.level, "%s", line.text)
        notifier.status(status_line(snapshot))
        await asyncio.sleep(period_s)


def status_line(snapshot: Snapshot) -> str:
    """The daemon's state in one line, for systemd and the log."""
    verdict = first_line(snapshot.verdict)
    radio = f"{snapshot.carrier.kind} {snapshot.carrier.state}"
    return f"{verdict}; {radio}; {traffic_line(snapshot)}"


def traffic_line(snapshot: Snapshot) -> str:
    """What was sent and received so far, in one line."""
    tx, rx = snapshot.link.tx, snapshot.link.rx
    return (
        f"out {tx.sent}/{tx.accepted} sent, {tx.queued} queued, "
        f"{sum(tx.dropped.values())} dropped; "
        f"in {rx.delivered} delivered, {len(snapshot.link.neighbors)} robots heard"
    )
