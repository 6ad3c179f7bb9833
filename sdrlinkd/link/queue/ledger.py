"""The ledger: counts every message that enters and what becomes of it (bus document, section 6)."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

TX_REASONS = {
    "tx_bad_envelope": "the bus message does not follow the envelope",
    "tx_unknown_topic": "the topic is not in the registry, or not subscribed",
    "tx_denied": "the producer may not publish this",
    "tx_too_big": "larger than 255 fragments can carry",
    "tx_size_cap": "larger than the topic's own size cap",
    "tx_throttled": "faster than the topic's period",
    "tx_decimated": "the topic sends one in so many",
    "tx_unchanged": "same content as the last one, and the topic sends changes only",
    "tx_filtered": "none of its frames are among those wanted ([tf])",
    "tx_combined": "joined with others of its topic into one message ([tf])",
    "tx_bad_transform": "not a tf2_msgs/TFMessage ([tf])",
    "tx_superseded": "a newer message of the topic took its place (depth)",
    "tx_topic_full": "the topic's own bound; its oldest went",
    "tx_overflow_old": "shed from a full queue: oldest of the lowest class",
    "tx_overflow_new": "refused by a full queue that holds only higher classes",
    "tx_expired": "its lifespan (its own, its topic's or its class's) ended before it was sent",
    "tx_stalled": "nothing of it could be sent for as long as receivers wait for the rest",
    "tx_radio_down": "no radio to send it",
    "tx_radio_failed": "the radio reported that a burst did not leave whole",
    "tx_no_nonce": "no packet number may be used (security)",
    "tx_shutdown": "the daemon stopped before it was sent",
}

RX_PDU_REASONS = {
    "rx_short": "not pdu_size bytes long",
    "rx_crc": "CRC mismatch",
    "rx_version": "another version of the wire format",
    "rx_flags": "sealed, which this node does not speak",
    "rx_entry": "entries that contradict themselves",
    "rx_pad": "PAD is not zero",
    "rx_not_for_us": "for another destination",
    "rx_own": "our own source id",
    "rx_dup": "heard before",
    "rx_relayed": "for others; forwarded",
    "rx_control": "control records only",
    "rx_control_bad": "control entries only, and none of them can be read",
    "sec_cleartext": "not sealed where sealing is required",
    "sec_unknown_kid": "sealed with a key we do not hold",
    "sec_replay": "packet number seen before",
    "sec_bad_tag": "authentication failed",
}

RX_REASONS = {
    "rx_partial_timeout": "fragments missing when the reassembly timeout ended",
    "rx_partial_superseded": "the sender used the entry id for another message",
    "rx_partial_evicted": "given up for newer ones: the source's memory bound",
    "rx_partial_memory": "given up: the bound on memory of all sources",
    "rx_expired": "its lifespan ended before it could be handed over",
    "rx_no_age": "no STAMP came with it, and its topic has a lifespan",
    "rx_size_cap": "larger than the topic's own size cap",
    "rx_bad_zstd": "its zstd frame cannot be read",
    "rx_inflates": "its zstd frame holds more than a message may have",
    "rx_no_dictionary": "compressed with a dictionary that this node does not have",
    "rx_bad_cdr": "no room for the four bytes of CDR encapsulation",
    "rx_unknown_topic": "a topic id that our registry does not have",
}


@dataclass(slots=True)
class TxTally:
    """Counters of the messages of one outgoing topic."""

    accepted: int = 0
    accepted_bytes: int = 0
    sent: int = 0
    sent_bytes: int = 0
    reoffered: int = 0
    """Latched messages sent again to late joiners; `accepted` includes them."""
    dropped: Counter[str] = field(default_factory=Counter)

    def accept(self, n_bytes: int = 0) -> None:
        """Count one message that entered, with `n_bytes` of payload from a producer."""
        self.accepted += 1
        self.accepted_bytes += n_bytes

    def accept_again(self) -> None:
        """Count one latched message that is sent again to late joiners."""
        self.accepted += 1
        self.reoffered += 1

    def send(self, n_bytes: int) -> None:
        """Count one message as sent."""
        self.sent += 1
        self.sent_bytes += n_bytes

    def drop(self, reason: str) -> None:
        """Count one message as dropped."""
        self.dropped[reason] += 1


@dataclass(slots=True)
class RxTally:
    """Counters of the messages of one topic from one source."""

    delivered: int = 0
    delivered_bytes: int = 0
    dropped: Counter[str] = field(default_factory=Counter)

    def deliver(self, n_bytes: int) -> None:
        """Count one message as delivered."""
        self.delivered += 1
        self.delivered_bytes += n_bytes

    def drop(self, reason: str) -> None:
        """Count one message as dropped."""
        self.dropped[reason] += 1


def balance(name: str, entered: int, parts: dict[str, int]) -> list[str]:
    """Empty if `entered` is the sum of `parts`; else one sentence with the discrepancy."""
    total = sum(parts.values())
    if total == entered and min(parts.values(), default=0) >= 0:
        return []
    listed = " + ".join(f"{value} {key}" for key, value in parts.items())
    return [f"{name}: {entered} entered, but {listed} = {total}"]


def tx_balance(tallies: Sequence[TxTally], queued: int, in_flight: int) -> list[str]:
    """Discrepancies in the transmit ledger over all topics; empty when it adds up."""
    dropped = sum((each.dropped for each in tallies), Counter[str]())
    return balance(
        "tx messages",
        sum(each.accepted for each in tallies),
        {
            "sent": sum(each.sent for each in tallies),
            "queued": queued,
            "in_flight": in_flight,
            **dropped,
        },
    )
