"""Types of control records, and the fields of most of them (wire document, section 6)."""

from enum import IntEnum
from typing import NamedTuple

from sdrlinkd.wire.registry import BROADCAST

NO_AGE = 0xFFFF


class RecordType(IntEnum):
    """Type of a control record, its first octet; numbers are never reused."""

    STAMP = 1
    BEACON = 2
    DIGEST = 3
    LINK_REPORT = 4
    RECEIPT = 5
    PARITY = 6
    FRAME = 7
    CLOCK = 8
    WAITS = 9
    NEED = 10
    WANT = 11
    GRANT = 12
    LSA = 13
    ROUTE = 14
    TOPIC = 15
    WANTED = 17
    REPEAT = 18
    CONTACT = 19
    KEY = 20
    BARE = 21
    FLOWS = 22
    ADMIT = 23
    LOST = 27
    FOUND = 28
    RATE = 29


class Stamp(NamedTuple):
    """STAMP record: age of a message at its burst's preamble in µs; `asks`: a RECEIPT is wanted."""

    topic_id: int
    entry_id: int
    age_us: int
    asks: bool = False


class Beacon(NamedTuple):
    """BEACON record: `boot_id` changes with every start, `number` counts up modulo 2^16.

    `pdu_number` is that of the PDU with the record, None if it is not told.
    """

    boot_id: int
    number: int
    pdu_number: int | None = None


class LinkReport(NamedTuple):
    """LINK_REPORT record: how well its sender hears `node` (wire document, 6.3).

    SNR is in quarter decibels (signed), PER in 1/255; `mcs` is the MCS that the sender suggests.
    """

    node: int
    snr_quarter_db: int
    per_255: int
    mcs: int


class Frame(NamedTuple):
    """FRAME record: the TDMA schedule that its sender keeps (wire document, 6.4).

    `root` is the robot whose schedule it is, `level` the number of hops from there, `schedule` an
    identification of its times, and `phase_us` the time in µs since the frame's start at this
    burst's preamble.
    """

    root: int
    level: int
    schedule: int
    phase_us: int


class Receipt(NamedTuple):
    """RECEIPT record: what became of a message of `node` at the sender (wire document, 6.7).

    `node` 255 means the destination of this PDU. The message's age at that time (65535: unknown or
    older) and the time since then are in units of 0.1 ms.
    """

    topic_id: int
    entry_id: int
    status: int
    node: int = BROADCAST
    age_100us: int = NO_AGE
    since_100us: int = 0


class Waits(NamedTuple):
    """WAITS record: shares, in 1/255, of the wait of a topic's messages at their source.

    They waited in the queue, for the channel, and for a retry after a burst that did not leave
    (wire document, 6.8).
    """

    topic_id: int
    queue: int
    access: int
    again: int


class Wanted(NamedTuple):
    """WANTED record: topics of `node` that consumers at the sender subscribe to, one octet each.

    Wire document, 6.10.
    """

    node: int
    topics: bytes


class Parity(NamedTuple):
    """PARITY record: octets from `at` on of a message's parity fragment `number`.

    The message has `total` fragments of `k` octets, and `size` octets in all (wire document, 6.5).
    """

    topic_id: int
    entry_id: int
    total: int
    n_parity: int
    number: int
    at: int
    k: int
    size: int
    data: bytes
