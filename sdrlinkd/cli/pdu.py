"""`pdu watch` and `pdu decode`: show PDUs octet by octet."""

from pathlib import Path
from typing import Annotated

import typer
import zmq
from rich.console import Console

from sdrlinkd.cli.app import RuntimeDir, app
from sdrlinkd.client import OUT_SOCKET, ControlClient, endpoint, unpack
from sdrlinkd.client import runtime_dir as find_runtime_dir
from sdrlinkd.config import load_registry
from sdrlinkd.errors import PduError, UserError
from sdrlinkd.wire import (
    BROADCAST,
    CONTROL_TOPIC_ID,
    DECLARED_TOPIC_ID,
    HELD_UNIT_S,
    MAX_PDU_SIZE,
    MIN_PDU_SIZE,
    TICKS_PER_S,
    Entry,
    Pdu,
    Registry,
    is_sealed,
    pad_length,
    parse,
    parse_records,
    parse_sealed,
)

pdus = typer.Typer(help="PDUs on the air.", no_args_is_help=True)
app.add_typer(pdus, name="pdu")

PDU_TAP = b"\0pdu\0"
SILENCE_MS = 1000
QOS_NAMES = ("default", "latency", "bulk", "urgent")

RegistryOption = Annotated[
    Path | None, typer.Option("--registry", help="Topic registry that names the topic ids.")
]


@pdus.command()
def decode(
    octets: Annotated[str, typer.Argument(metavar="HEX", help="Octets of the PDU; -: read stdin.")],
    registry: RegistryOption = None,
) -> None:
    """Show the header, topic ids and entry layout of a PDU."""
    text = typer.get_text_stream("stdin").read() if octets == "-" else octets
    try:
        data = bytes.fromhex("".join(text.replace(":", " ").split()))
    except ValueError as error:
        raise UserError(f"HEX: {error}; allowed: octets such as 0001ff…") from None
    if not MIN_PDU_SIZE <= len(data) <= MAX_PDU_SIZE:
        raise UserError(
            f"HEX: got {len(data)} octets; allowed: a whole PDU, {MIN_PDU_SIZE} to {MAX_PDU_SIZE}"
        )
    names = load_registry(registry) if registry else None
    Console().print(explain(data, names), highlight=False, markup=False)
    try:
        (parse_sealed if is_sealed(data) else parse)(data, len(data))
    except PduError as error:
        raise UserError(f"refused as {error.reason}: {error.detail}") from None


@pdus.command()
def watch(
    count: Annotated[
        int, typer.Option("--count", "-n", min=0, help="PDUs to show; 0: until Ctrl-C.")
    ] = 0,
    layout: Annotated[bool, typer.Option("--layout", help="Show all fields of each PDU.")] = False,
    registry: RegistryOption = None,
    runtime_dir: RuntimeDir = None,
) -> None:
    """Show PDUs as they are sent and heard."""
    names = load_registry(registry) if registry else None
    console = Console()
    directory = find_runtime_dir(runtime_dir)
    _ask_hello(directory)
    context = zmq.Context()
    with context.socket(zmq.SUB) as socket:
        socket.connect(endpoint(directory, OUT_SOCKET))
        socket.subscribe(PDU_TAP)
        shown = 0
        while not count or shown < count:
            if not socket.poll(SILENCE_MS):
                _ask_hello(directory)
                continue
            _, header, data = socket.recv_multipart()
            direction = unpack(header[1:])["dir"]
            arrow = "→" if direction == "tx" else "←"
            console.print(
                f"{arrow} {explain(data, names) if layout else one_line(data, names)}",
                highlight=False,
                markup=False,
            )
            shown += 1
    context.term()


def _ask_hello(directory: Path) -> None:
    """Check that the daemon answers. Raises NoDaemonError if it does not."""
    with ControlClient(directory) as control:
        control.ask("hello")


def _sealed_line(data: bytes) -> str:
    """What everybody can read of a sealed PDU. Raises PduError."""
    pdu = parse_sealed(data, len(data))
    return (
        f"sealed with key {pdu.kid}, T {pdu.ticks / TICKS_PER_S:.2f} s, held "
        f"{1e3 * pdu.held * HELD_UNIT_S:.1f} ms"
    )


def one_line(data: bytes, registry: Registry | None) -> str:
    """A PDU in one line of text."""
    try:
        if is_sealed(data):
            src, dst, seq, hop = data[1], data[2], data[3], data[4] >> 4
            told = _sealed_line(data)
            to = "all" if dst == BROADCAST else dst
            return f"src {src} dst {to} seq {seq} hop {hop} {QOS_NAMES[data[0] >> 2 & 3]}: {told}"
        pdu = parse(data, len(data))
    except PduError as error:
        return f"{len(data)} B refused as {error}"
    entries = " ".join(
        f"{_topic(entry, registry)}#{entry.entry_id} {entry.index + 1}/{entry.total} "
        f"({len(entry.payload)} B)"
        for entry in pdu.entries
    )
    return (
        f"src {pdu.src} dst {_dst(pdu)} seq {pdu.seq} hop {pdu.hop} {QOS_NAMES[pdu.qos]}: {entries}"
    )


def explain(data: bytes, registry: Registry | None) -> str:
    """A PDU field by field, as far as it can be read."""
    lines = [f"{len(data)} octets"]
    if len(data) >= 5:
        flags, src, dst, seq, hop_count = data[:5]
        lines.append(
            f"header  {data[:5].hex(' ')}   V={flags >> 4} Q={flags >> 2 & 3} "
            f"({QOS_NAMES[flags >> 2 & 3]}) C={flags >> 1 & 1} E={flags & 1}  src {src}  "
            f"dst {dst}  seq {seq}  hop {hop_count >> 4}  entries {hop_count & 15}"
        )
    try:
        if is_sealed(data):
            return "\n".join([*lines, f"inside  {_sealed_line(data)}; not readable here"])
        pdu = parse(data, len(data))
    except PduError:
        return "\n".join(lines)
    n = len(pdu.entries)
    end = 5 + (n + 1) // 2
    lines.append(
        f"topics  {data[5:end].hex(' ')}   "
        + ", ".join(_topic(entry, registry) for entry in pdu.entries)
    )
    for i, entry in enumerate(pdu.entries):
        lines.append(
            f"entry {i}  id {entry.entry_id}  fragment {entry.index + 1} of {entry.total}  "
            f"{len(entry.payload)} B  {entry.payload[:16].hex(' ')}"
            + (" …" if len(entry.payload) > 16 else "")
        )
        if entry.topic_id == CONTROL_TOPIC_ID and entry.total == 1:
            lines += _records(entry.payload)
    pad = pad_length(len(data), [len(entry.payload) for entry in pdu.entries])
    lines.append(f"pad     {pad} B")
    lines.append(f"crc     {data[-2:].hex(' ')}   good")
    return "\n".join(lines)


def _records(payload: bytes) -> list[str]:
    try:
        return [f"         {record}" for record in parse_records(payload)]
    except PduError:
        return ["         (not valid control records; skipped as rx_control_bad)"]


def _topic(entry: Entry, registry: Registry | None) -> str:
    topic = registry.by_id(entry.topic_id) if registry else None
    if topic is not None:
        return topic.name
    if entry.topic_id == DECLARED_TOPIC_ID and entry.payload:
        # Or an ordinary topic, where the robots do not use numbers.
        number = entry.payload[0]
        return f"number {number}" if number else "part of a large message"
    return "control" if entry.topic_id == CONTROL_TOPIC_ID else f"topic {entry.topic_id}"


def _dst(pdu: Pdu) -> str:
    return "all" if pdu.dst == BROADCAST else str(pdu.dst)
