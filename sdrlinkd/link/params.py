"""What steers the link. Defaults, ranges and meaning stand here and nowhere else."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from sdrlinkd.wire import MAX_PDU_SIZE, MIN_PDU_SIZE


class QueueParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How much may wait for the radio, all topics together."""

    max_messages: Annotated[int, Meta(ge=1, le=1_000_000)] = 10_000
    max_bytes: Annotated[int, Meta(ge=1)] = 16 << 20
    max_airtime_s: Annotated[float, Meta(gt=0)] = float("inf")
    """As many bytes as the air carries in this time."""


class ReassemblyParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How long and how much is kept of messages that are not complete yet."""

    timeout_s: Annotated[float, Meta(gt=0, le=60)] = 0.5
    """Seconds without a new fragment; the same at all nodes. A topic can send 256 fragmented
    messages in 1.25 times this."""
    source_bytes: Annotated[int, Meta(ge=1 << 16)] = 1 << 20
    total_bytes: Annotated[int, Meta(ge=1 << 16)] = 8 << 20


class LinkParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The paper's source keys (section 4.3) and ours."""

    pdu_size: Annotated[int, Meta(ge=MIN_PDU_SIZE, le=MAX_PDU_SIZE)] = 1024
    """Bytes of every PDU on the air, P_max; the same at all nodes."""
    min_fragment: Annotated[int, Meta(ge=1, le=MAX_PDU_SIZE)] = 16
    """Least payload bytes of an entry when topics share PDUs, k_min."""
    greedy: bool = True
    """Fill a PDU with further entries of the same topics."""
    flush_s: Literal["now"] | Annotated[float, Meta(ge=0)] = "now"
    """Time a PDU that is not full may wait for more; "now": none. 0.0 is the paper's: without end,
    never by time. Urgent, latency and messages with a lifespan never wait."""
    dst: Annotated[int, Meta(ge=0, le=255)] = 255
    """Destination robot of topics that name none; 255: everyone."""
    hop_limit: Annotated[int, Meta(ge=1, le=15)] = 1
    """Hops a PDU may travel; more than 1 asks relays to forward it."""
    beacon_s: Annotated[float, Meta(ge=0)] = 1.0
    """Period of beacons (presence, registry digest); 0: none."""
    receipt_s: Annotated[float, Meta(gt=0, le=60)] = 3.0
    """So long is waited for the RECEIPT of a message whose producer wants to know of it."""
