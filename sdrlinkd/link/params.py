"""Settings of the link; their defaults, ranges and meanings are defined only here."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from sdrlinkd.wire import MAX_PDU_SIZE, MIN_PDU_SIZE


class QueueParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Limits of the queue for the radio, all topics together."""

    max_messages: Annotated[int, Meta(ge=1, le=1_000_000)] = 10_000
    """Most messages that may wait."""
    max_bytes: Annotated[int, Meta(ge=1, le=1 << 40)] = 16 << 20
    """Most bytes of payload that may wait."""
    max_airtime_s: Annotated[float, Meta(gt=0)] = float("inf")
    """Limit as airtime in s: the bytes that the channel carries in this time."""


class ReassemblyParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How long, and in how much memory, incomplete messages are kept."""

    timeout_s: Annotated[float, Meta(gt=0, le=60)] = 0.5
    """Time in s without a new fragment after which a message is given up; the same at all nodes. A
    topic can send 256 fragmented messages in 1.25 times this."""
    source_bytes: Annotated[int, Meta(ge=1 << 16, le=1 << 40)] = 12 << 20
    """Memory for incomplete messages of one robot."""
    total_bytes: Annotated[int, Meta(ge=1 << 16, le=1 << 40)] = 48 << 20
    """Memory for incomplete messages of all robots together."""


class LinkParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Settings of the link: the paper's keys of a source (section 4.3) and our own."""

    pdu_size: Annotated[int, Meta(ge=MIN_PDU_SIZE, le=MAX_PDU_SIZE)] = 1024
    """Size of every PDU on the air in bytes, P_max; the same at all nodes."""
    min_fragment: Annotated[int, Meta(ge=1, le=MAX_PDU_SIZE)] = 16
    """Smallest payload of an entry in bytes when topics share PDUs, k_min."""
    greedy: bool = True
    """Whether to fill a PDU with further entries of the same topics."""
    flush_s: Literal["now"] | Annotated[float, Meta(ge=0)] = "now"
    """Time in s that a PDU may wait until it is full; "now": no wait; 0.0: until it is full, as in
    the paper. Urgent and latency messages and messages with a lifespan never wait."""
    dst: Annotated[int, Meta(ge=0, le=255)] = 255
    """Destination robot of topics without their own destination; 255: everyone."""
    hop_limit: Annotated[int, Meta(ge=1, le=15)] = 1
    """Hops that a PDU may travel; with more than 1, relays forward it."""
    beacon_s: Annotated[float, Meta(ge=0)] = 1.0
    """Period of beacons (presence, registry digest) in s; 0: no beacons."""
    receipt_s: Annotated[float, Meta(gt=0, le=60)] = 3.0
    """Time in s to wait for a message's RECEIPT, if its producer wants one."""
