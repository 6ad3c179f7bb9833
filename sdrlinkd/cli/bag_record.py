"""`bag record`: writes what other robots sent, and on request what this one sends, to a bag."""

import contextlib
import json
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from types import FrameType
from typing import Annotated, Self

import typer
import zmq
from rich.console import Console
from rich.live import Live

from sdrlinkd.adapters import BagWriter, Recorded, cdr_from_fields
from sdrlinkd.asking import ask_status
from sdrlinkd.bus import SENT_TAP, fields_of
from sdrlinkd.cli.app import RuntimeDir, connect
from sdrlinkd.cli.bag import bags
from sdrlinkd.cli.completion import heard_names
from sdrlinkd.client import OUT_SOCKET, Message, NoDaemonError, Subscriber, endpoint
from sdrlinkd.client import runtime_dir as find_runtime_dir
from sdrlinkd.units import octets

RECEPTIONS = "/link/receptions"
TEXT = "std_msgs/msg/String"
LOOK_S = 0.1
SYNC_S = 1.0
LONGEST_SYNC_S = 10.0
SYNC_SHARE = 600
"""A bag that is so many times as old as SYNC_S is synced less often, as its index grows."""


@bags.command()
def record(
    out: Annotated[Path, typer.Argument(help="Folder to be made, a rosbag2 of MCAP files.")],
    topics: Annotated[
        list[str] | None,
        typer.Argument(
            help="Bus topics, such as /rx_robot_2/odom, or prefixes with *; default: all.",
            autocompletion=heard_names,
        ),
    ] = None,
    sent: Annotated[
        bool, typer.Option("--sent", help="Record what this robot's programs send, too.")
    ] = False,
    split: Annotated[
        float, typer.Option(min=0, max=1e6, help="Seconds in a file; 0: one file.")
    ] = 0.0,
    max_size: Annotated[
        str, typer.Option(help="Size of a file, such as 500MB or 2GB; 0: no limit.")
    ] = "0",
    duration: Annotated[
        float | None, typer.Option(min=0.001, help="Stop after this many seconds.")
    ] = None,
    runtime_dir: RuntimeDir = None,
) -> None:
    """Record messages until Ctrl-C. The bag is whole at every moment, even after a crash."""
    limit = octets(max_size, "--max-size")
    stopping: list[int] = []

    def stop(number: int, _: FrameType | None) -> None:
        stopping.append(number)

    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, stop)
    catalogue = _Catalogue(runtime_dir)
    writer = BagWriter(out, split, limit)
    begin, n_heard = time.monotonic(), 0
    console = Console(stderr=True)
    try:
        with (
            Subscriber(*(topics or ()), runtime_dir=runtime_dir) as heard,
            _Copies(find_runtime_dir(runtime_dir), sent, catalogue) as copies,
            Live(console=console, refresh_per_second=2, transient=True) as live,
        ):
            console.print(f"recording in {out}, until Ctrl-C", markup=False, highlight=False)
            synced_at = begin
            while not stopping:
                message = heard.receive(LOOK_S)
                if message is not None:
                    n_heard += 1
                    for each in _recorded(message, catalogue.is_latched(message.topic)):
                        writer.add(each)
                for each in copies.take():
                    writer.add(each)
                now = time.monotonic()
                lasted_s = now - begin
                if now - synced_at >= min(LONGEST_SYNC_S, max(SYNC_S, lasted_s / SYNC_SHARE)):
                    synced_at = now
                    writer.sync()
                    live.update(_progress(writer, n_heard, lasted_s))
                if duration is not None and lasted_s >= duration:
                    break
    finally:
        writer.close()
    typer.echo(f"recorded {_progress(writer, n_heard, time.monotonic() - begin)} in {out}")


def _progress(writer: BagWriter, n_heard: int, lasted_s: float) -> str:
    """What was recorded; of each message heard, the bag has a note on its reception besides."""
    return (
        f"{writer.n_messages - n_heard} messages, {writer.n_bytes / 1e6:.2f} MB, {lasted_s:.1f} s"
    )


def _recorded(message: Message, is_latched: bool) -> Iterator[Recorded]:
    """A message, and what the link knows of its reception."""
    received_ns = message.received_ns or time.time_ns()
    published_ns = message.published_ns
    if published_ns is None:
        published_ns = received_ns - 1000 * (message.age_us or 0)
    yield Recorded(
        message.topic, message.type, message.payload, received_ns, published_ns, is_latched
    )
    fields = {
        "topic": message.topic,
        "robot": message.source,
        "number": message.number,
        "age_ms": None if message.age_us is None else message.age_us / 1000,
        "snr_db": message.snr_db,
        "lost_pdus": message.lost_pdus,
        "late": message.is_late,
        "sealed": message.is_sealed,
    }
    text = cdr_from_fields(TEXT, {"data": json.dumps(fields)}, RECEPTIONS)
    yield Recorded(RECEPTIONS, TEXT, text, received_ns, received_ns)


class _Catalogue:
    """What the daemon knows of topics; it is asked again when a name is new.

    Raises NoDaemonError if no daemon answers at the start.
    """

    def __init__(self, runtime_dir: Path | None) -> None:
        self._runtime_dir = runtime_dir
        self._latched: dict[str, bool] = {}
        self._types: dict[str, str] = {}
        self._ask()

    def is_latched(self, topic: str) -> bool:
        """Whether a topic of another robot is kept for late joiners."""
        if topic not in self._latched:
            self._look_up()
        return self._latched.setdefault(topic, False)

    def type_of(self, topic: str) -> str:
        """The type of a topic of this robot; empty if the daemon does not know it."""
        if topic not in self._types:
            self._look_up()
        return self._types.setdefault(topic, "")

    def _look_up(self) -> None:
        with contextlib.suppress(NoDaemonError):
            self._ask()

    def _ask(self) -> None:
        with connect(self._runtime_dir) as control:
            heard, topics = control.ask("declared"), ask_status(control).link.topics
        self._latched |= {each["topic"]: each["latched"] > 0 for each in heard}
        self._types |= {each.name: each.type for each in topics}


class _Copies:
    """Copies of the messages that this robot's programs send; none unless `is_wanted`."""

    def __init__(self, directory: Path, is_wanted: bool, catalogue: _Catalogue) -> None:
        self._catalogue = catalogue
        self._context = zmq.Context()
        self._socket = self._context.socket(zmq.SUB)
        self._socket.rcvhwm = 0
        if is_wanted:
            self._socket.connect(endpoint(directory, OUT_SOCKET))
            self._socket.subscribe(SENT_TAP)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close(linger=0)
        self._context.term()

    def take(self) -> Iterator[Recorded]:
        """The copies that have come."""
        try:
            while True:
                frames = self._socket.recv_multipart(zmq.NOBLOCK)
                name = frames[0].removeprefix(SENT_TAP)[:-1].decode(errors="replace")
                published_ns = fields_of(frames).get("t")
                sent_ns = published_ns if isinstance(published_ns, int) else time.time_ns()
                yield Recorded(name, self._catalogue.type_of(name), frames[2], sent_ns, sent_ns)
        except zmq.Again:
            return
