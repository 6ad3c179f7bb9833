"""Bus messages as Python values (bus document, section 3)."""

import secrets
from collections.abc import Sequence
from dataclasses import dataclass

from sdrlinkd.client.errors import EnvelopeMismatchError
from sdrlinkd.client.flatmap import unpack
from sdrlinkd.client.names import MessageName, name_in

ENVELOPE_VERSION = b"\x01"
# Only one client subscribes to an ack topic. The daemon answers on it when the subscription is
# active, and again when it has received a message under SYNC_PREFIX with the same token.
ACK_PREFIX = b"\0ack\0"
SYNC_PREFIX = b"\0sync\0"
RECEIPT_PREFIX = b"\0receipt\0"
# Only one client subscribes to a late topic, which ends with a filter. The daemon answers on it
# with the messages that it has kept under this filter.
LATE_PREFIX = b"\0late\0"
WELCOME_PREFIX = b"\0" + ENVELOPE_VERSION
"""First bytes of an announcement, which is a single frame."""


@dataclass(frozen=True, slots=True)
class Message:
    """A message that another robot sent.

    `number` counts messages per (source, topic); a step of more than one means that this consumer
    missed messages on the bus. `lost_pdus` is the number of the source's PDUs known to be lost on
    the air so far. `received_ns` is when the message arrived, in ns since 1970 by this host's
    clock.

    `age_us` is the message's age at its handover in µs, None when unknown. Parts of that age are
    `waited_us` (at its source), `reassembly_us` (from the first fragment to the last) and
    `on_air_us` (the last fragment).

    `published_ns` is when the message was published, and `sampled_ns` the stamp of its
    std_msgs/Header; both are in ns since 1970 by this host's clock, each with the bound of its
    error in µs, and None when unknown. `is_stop` marks the stop message of a command topic, which
    the daemon publishes when the topic falls silent. `is_late` marks a message that was received
    before this subscriber subscribed, and kept for it; `age_us` is its age when it was handed over.
    `series` tells apart the messages of several producers of one declared topic; it is 0 for the
    first producer, and for topics of the registry. `name` tells the message from others at all
    robots that hear it; stop messages have none. `via` is the robot of the gateway that sent the
    message for `source`, which is on another air; None if `source` sent it itself. `is_sealed`
    tells that all of it came sealed, so that somebody with the team's key has sent it.
    """

    topic: str
    payload: bytes
    type: str
    source: int
    number: int
    lost_pdus: int
    age_us: int | None
    received_ns: int
    hops_left: int
    snr_db: float | None
    published_ns: int | None = None
    published_error_us: int | None = None
    sampled_ns: int | None = None
    sampled_error_us: int | None = None
    waited_us: int | None = None
    reassembly_us: int | None = None
    on_air_us: int | None = None
    is_stop: bool = False
    is_late: bool = False
    series: int = 0
    name: MessageName | None = None
    via: int | None = None
    is_sealed: bool = False


@dataclass(frozen=True, slots=True)
class Receipt:
    """What became of a message at robot `dst`: `fate` is delivered, expired, dropped or unknown.

    `dst` is 255 if the message was sent to everyone and no robot was heard that could answer.
    `reason` is one of the ledger's, or `daemon_gone` if the fate is unknown because our own daemon
    restarted or does not answer. `took_s` is the message's age in s at its delivery. `left` is the
    number of robots that have not answered yet, and `repeats` counts the PDUs with parts of it that
    were sent again.
    """

    id: str
    topic: str
    dst: int
    fate: str
    reason: str = ""
    took_s: float | None = None
    left: int = 0
    repeats: int = 0


def decode_receipt(frames: Sequence[bytes]) -> Receipt | None:
    """The receipt in the daemon's frames; None for any other message."""
    if len(frames) != 2 or not frames[0].startswith(RECEIPT_PREFIX):
        return None
    fields = unpack(frames[1][1:])
    return Receipt(
        id=fields["id"],
        topic=fields["topic"],
        dst=fields["d"],
        fate=fields["fate"],
        reason=fields.get("reason", ""),
        took_s=fields.get("took"),
        left=fields.get("left", 0),
        repeats=fields.get("repeats", 0),
    )


def decode_in(frames: Sequence[bytes]) -> Message | None:
    """The message in the daemon's frames; None for the daemon's own announcements.

    Raises EnvelopeMismatchError.
    """
    if frames[0].startswith(b"\0"):
        return None
    if len(frames) != 3 or frames[1][:1] != ENVELOPE_VERSION:
        raise EnvelopeMismatchError("the daemon speaks another envelope version; update the client")
    fields = unpack(frames[1][1:])
    return Message(
        topic=frames[0][:-1].decode(),
        payload=frames[2],
        type=fields.get("ty", ""),
        source=fields["s"],
        number=fields["n"],
        lost_pdus=fields.get("g", 0),
        age_us=fields.get("age"),
        received_ns=fields.get("tr", 0),
        hops_left=fields.get("h", 0),
        snr_db=fields.get("sn"),
        published_ns=fields.get("tl"),
        published_error_us=fields.get("eb"),
        sampled_ns=fields.get("ts"),
        sampled_error_us=fields.get("es"),
        waited_us=fields.get("dw"),
        reassembly_us=fields.get("dr"),
        on_air_us=fields.get("da"),
        is_stop=fields.get("stop", False),
        is_sealed=fields.get("se", False),
        is_late=fields.get("late", False),
        series=fields.get("sr", 0),
        name=name_in(fields),
        via=fields.get("v"),
    )


def topic_filter(topic: str) -> bytes:
    """The ZeroMQ subscription for `topic`: exact, or a prefix when it ends with `*`."""
    # A bare `*` becomes "/", so that it does not match the daemon's own announcements.
    return (topic[:-1] or "/").encode() if topic.endswith("*") else topic.encode() + b"\0"


def new_ack_topic() -> bytes:
    """A new topic for one handshake with the daemon."""
    return ACK_PREFIX + secrets.token_hex(8).encode() + b"\0"


def new_late_topic(filter_: bytes) -> bytes:
    """A new topic that requests the kept messages under the subscription `filter_`."""
    return LATE_PREFIX + secrets.token_hex(8).encode() + b"\0" + filter_


def sync_frames(ack_topic: bytes) -> list[bytes]:
    """The message that requests a second answer on `ack_topic`."""
    return [SYNC_PREFIX + ack_topic.removeprefix(ACK_PREFIX), ENVELOPE_VERSION + b"\x80", b""]
