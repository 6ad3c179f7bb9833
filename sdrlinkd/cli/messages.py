"""`pub` and `echo`: publish and show single messages, like `ros2 topic`."""

import contextlib
import threading
import time
from collections import Counter
from collections.abc import Iterator
from io import StringIO
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from sdrlinkd.adapters import cdr_from_fields, from_cdr, knows
from sdrlinkd.asking import ask_status
from sdrlinkd.cli.app import RuntimeDir, app, connect
from sdrlinkd.cli.completion import heard_names, one_of, robot_names, topic_names
from sdrlinkd.cli.names import refuse_own, topic_sent
from sdrlinkd.client import (
    LEAST_RATE_HZ,
    MOST_RATE_HZ,
    QOS,
    Message,
    NoDaemonError,
    Publisher,
    RefusedError,
    Subscriber,
)
from sdrlinkd.errors import CdrError, UserError
from sdrlinkd.link import CDR_HEADER_SIZE
from sdrlinkd.units import seconds
from sdrlinkd.wire import BROADCAST

MAX_SHOWN_ITEMS = 12


RENEW_S = 2.0
"""A rate that is asked for holds for 5 s."""


@app.command()
def pub(
    topic: Annotated[
        str,
        typer.Argument(
            help="Topic name on the bus or in the registry.", autocompletion=topic_names
        ),
    ],
    values: Annotated[
        str, typer.Argument(help="Fields in YAML: '{linear: {x: 0.5}}'; others keep their default.")
    ] = "{}",
    cdr_file: Annotated[
        Path | None, typer.Option("--cdr", help="Send this file's CDR bytes instead.")
    ] = None,
    declare: Annotated[
        str | None,
        typer.Option(
            "--declare", help="Declare the topic with this type first, as in std_msgs/msg/String."
        ),
    ] = None,
    rate: Annotated[
        float, typer.Option("--rate", "-r", min=0.0, max=1e6, help="Rate in Hz; 0: send once.")
    ] = 0.0,
    times: Annotated[int, typer.Option("--times", "-t", min=0, help="0: until Ctrl-C.")] = 0,
    qos: Annotated[
        str | None,
        typer.Option(help="urgent, latency, default or bulk.", autocompletion=one_of(*QOS)),
    ] = None,
    priority: Annotated[int | None, typer.Option(min=0, max=127)] = None,
    dst: Annotated[
        int | None,
        typer.Option(min=0, max=255, help="Destination robot.", autocompletion=robot_names),
    ] = None,
    lifespan: Annotated[
        str | None,
        typer.Option(help="Discard when older than this: 300ms, 2s; plain numbers are seconds."),
    ] = None,
    receipt: Annotated[
        bool, typer.Option("--receipt", help="Report the outcome of each message at each robot.")
    ] = False,
    runtime_dir: RuntimeDir = None,
) -> None:
    """Publish a message to the daemon."""
    if qos is not None and qos not in QOS:
        raise UserError(f'--qos: got "{qos}"; allowed: {", ".join(QOS)}')
    lifespan_ms = None if lifespan is None else 1e3 * seconds(lifespan, "--lifespan")
    if lifespan_ms == 0:
        raise UserError(f"--lifespan: got {lifespan}; allowed: more than 0")
    with connect(runtime_dir) as control:
        snapshot = ask_status(control)
        if declare is not None:
            full = topic if topic.startswith("/") else f"/{snapshot.namespace.strip('/')}/{topic}"
            control.ask("declare", {"name": full, "type": declare})
            snapshot = ask_status(control)
        sent = topic_sent(topic, snapshot)
    topic, kind = sent.name, sent.type
    payload = _read(cdr_file) if cdr_file else _serialize(values, kind)
    if times > 1 and not rate:
        rate = 1.0
    if rate:
        until = f"{times} times" if times else "until Ctrl-C"
        typer.echo(f"publishing {len(payload)} B on {topic} at {rate:g} Hz, {until}", err=True)
    console = Console(stderr=True)
    count, waiting, fates = 0, dict[str, int](), Counter[str]()
    with (
        Publisher(runtime_dir) as publisher,
        contextlib.ExitStack() as stack,
    ):
        if rate:
            # Also where Ctrl-C ends it.
            stack.callback(lambda: typer.echo(f"published {count} × {len(payload)} B on {topic}"))
        live = stack.enter_context(console.status("")) if rate and console.is_terminal else None
        while True:
            name = publisher.send(
                topic,
                payload,
                qos=qos,
                priority=priority,
                dst=dst,
                lifespan_ms=lifespan_ms,
                type=kind,
                receipt=receipt,
            )
            count += 1
            if live is not None:
                live.update(f"{count} published")
            if isinstance(name, str):
                waiting[name] = count
            if not rate or count == times:
                break
            next_at = time.monotonic() + min(1 / rate, 1e6)
            fates += _show_receipts(publisher, waiting, next_at)
            time.sleep(max(0.0, next_at - time.monotonic()))
        fates += _show_receipts(publisher, waiting)
    if not rate:
        typer.echo(f"published {count} × {len(payload)} B on {topic} ({kind})")
    if fates["unknown"]:
        typer.echo(
            "no answer to some: `sdrlinkctl status` lists the robots that are heard", err=True
        )
    if fates.total() > fates["delivered"]:
        raise typer.Exit(1)


def _show_receipts(
    publisher: Publisher, waiting: dict[str, int], until: float | None = None
) -> Counter[str]:
    """Show receipts until all messages in `waiting`, by id, are answered, or until time `until`.

    Returns how many receipts had each fate.
    """
    fates: Counter[str] = Counter()
    while waiting:
        told = publisher.receipt(None if until is None else max(0.0, until - time.monotonic()))
        if told is None:
            break
        fates[told.fate] += 1
        robot = "everyone" if told.dst == BROADCAST else f"robot {told.dst}"
        reason = f" ({told.reason})" if told.reason else ""
        took = "" if told.took_s is None else f", {1e3 * told.took_s:.2f} ms old"
        again = f", {told.repeats} PDUs sent again" if told.repeats else ""
        typer.echo(f"message {waiting[told.id]}, {robot}: {told.fate}{reason}{took}{again}")
        if not told.left:
            del waiting[told.id]
    return fates


@app.command()
def echo(
    topic: Annotated[
        str,
        typer.Argument(
            help="Bus topic, such as /rx_robot_2/odom, or a prefix with *.",
            autocompletion=heard_names,
        ),
    ] = "/*",
    raw: Annotated[bool, typer.Option("--raw", help="Show the CDR bytes in hex.")] = False,
    count: Annotated[int, typer.Option("--count", "-n", min=0, help="0: until Ctrl-C.")] = 0,
    timeout: Annotated[
        float | None,
        typer.Option(min=0, max=1e6, help="Stop after this many seconds without a message."),
    ] = None,
    rate: Annotated[
        float | None,
        typer.Option(
            min=LEAST_RATE_HZ,
            max=MOST_RATE_HZ,
            help="Ask the sender for so many a second at most.",
        ),
    ] = None,
    runtime_dir: RuntimeDir = None,
) -> None:
    """Show messages received from other robots."""
    console = Console()
    shown = 0
    with connect(runtime_dir) as control:
        refuse_own(topic, ask_status(control), str(control.ask("config")["rx_format"]))
    with (
        Subscriber(topic, runtime_dir=runtime_dir) as subscriber,
        contextlib.ExitStack() as stack,
    ):
        if rate is not None:
            stack.enter_context(_asking(topic, rate, runtime_dir))
        while message := subscriber.receive(timeout):
            _print(console, _headline(message), style="bold")
            _print(console, message.payload.hex(" ") if raw else as_yaml(message).rstrip("\n"))
            _print(console, "---")
            shown += 1
            if shown == count:
                return
    if count or not shown:
        raise UserError(
            f"{topic}: {shown} messages before --timeout; `sdrlinkctl topics` lists received topics"
        )


@contextlib.contextmanager
def _asking(topic: str, hz: float, runtime_dir: Path | None) -> Iterator[None]:
    """Ask for fewer messages of a topic, again and again. Raises RefusedError."""
    over = threading.Event()

    def ask() -> None:
        while not over.wait(RENEW_S):
            # A daemon that is away may come back.
            with contextlib.suppress(NoDaemonError, RefusedError), connect(runtime_dir) as control:
                control.ask("rate", {"topic": topic, "hz": hz})

    with connect(runtime_dir) as control:
        control.ask("rate", {"topic": topic, "hz": hz})
    asking = threading.Thread(target=ask, daemon=True)
    asking.start()
    try:
        yield
    finally:
        over.set()
        asking.join()


def _print(console: Console, text: str, style: str | None = None) -> None:
    # The terminal wraps long lines; in a file they stay whole.
    console.print(text, style=style, highlight=False, markup=False, soft_wrap=True)


def as_yaml(message: Message) -> str:
    """A message's fields as YAML, with long arrays cut; if impossible, the reason in brackets."""
    size = len(message.payload)
    if not knows(message.type):
        return f"({message.type} is not known here; --raw shows {size} bytes)\n"
    try:
        fields = from_cdr(message.payload, message.type)
    except CdrError as error:
        return f"(bad message of {size} bytes, {error}; --raw shows them)\n"
    out = StringIO()
    writer = YAML(typ="safe", pure=True)
    writer.default_flow_style = None
    writer.width = 100
    writer.dump(_plain(fields), out)
    return out.getvalue()


def _headline(message: Message) -> str:
    age = "age unknown" if message.age_us is None else f"age {message.age_us / 1e3:.2f} ms"
    kept = ", kept" if message.is_late else ""
    return f"{message.topic} from robot {message.source}, number {message.number}, {age}{kept}"


def _plain(value: Any) -> Any:  # noqa: ANN401
    """A message as dicts, lists and numbers, with long lists cut."""
    if hasattr(value, "__msgtype__"):
        names = [name for name in value.__dataclass_fields__ if not name.startswith("_")]
        return {name: _plain(getattr(value, name)) for name in names}
    if isinstance(value, np.ndarray | list):
        items = [_plain(item) for item in value[:MAX_SHOWN_ITEMS]]
        more = len(value) - len(items)
        return [*items, f"… {more} more"] if more else items
    return value.item() if isinstance(value, np.generic) else value


def _serialize(values: str, kind: str) -> bytes:
    try:
        given = YAML(typ="safe", pure=True).load(values)
    except YAMLError as error:
        raise UserError(f"fields of {kind}: not YAML: {error}") from None
    if not isinstance(given, dict):
        raise UserError(
            f"fields of {kind}: got {values!r}; allowed: a map such as '{{linear: {{x: 0.5}}}}'"
        )
    return cdr_from_fields(kind, given, kind)


def _read(path: Path) -> bytes:
    try:
        data = path.read_bytes()
    except OSError as error:
        raise UserError(f"--cdr: {path} cannot be read ({error.strerror})") from None
    if len(data) < CDR_HEADER_SIZE:
        raise UserError(f"--cdr: {path} has {len(data)} bytes; CDR begins with a header of 4")
    return data
