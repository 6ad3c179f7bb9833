"""The ledger: counts every message that enters and what becomes of it (bus document, section 6)."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

TX_REASONS = {
    "tx_bad_envelope": "the bus message violates the envelope format",
    "tx_unknown_topic": "the topic is not in the registry, or not subscribed",
    "tx_denied": "the producer may not publish this",
    "tx_too_big": "larger than PDUs of this size can carry",
    "tx_size_cap": "larger than the topic's max_bytes",
    "tx_throttled": "faster than the topic's period",
    "tx_not_admitted": "the team's air is full, and the topic's flow was refused (reserve)",
    "tx_decimated": "decimated: the topic sends one message in several",
    "tx_unchanged": "same content as the last message, and the topic sends only changes",
    "tx_filtered": "none of its frames are selected ([tf])",
    "tx_combined": "merged with others of its topic into one message ([tf])",
    "tx_bad_transform": "not a tf2_msgs/TFMessage ([tf])",
    "tx_superseded": "replaced by a newer message of the topic (depth)",
    "tx_topic_full": "the topic's own queue limit; its oldest message was dropped",
    "tx_overflow_old": "shed from a full queue: the oldest of the topic that fills its class",
    "tx_overflow_new": "refused by a full queue that holds only higher classes",
    "tx_expired": "its lifespan (its own, its topic's or its class's) ended before it was sent",
    "tx_too_slow": "a command that takes longer on the air than its lifespan",
    "tx_stalled": "no fragment of it could be sent within the receivers' reassembly timeout",
    "tx_radio_down": "no radio to send it",
    "tx_radio_failed": "the radio reported an incomplete burst",
    "tx_shutdown": "the daemon stopped before it was sent",
}

RX_PDU_REASONS = {
    "rx_short": "not pdu_size bytes long",
    "rx_crc": "CRC mismatch",
    "rx_version": "another version of the wire format",
    "rx_flags": "sealed, and this node has no key",
    "rx_entry": "entries that contradict themselves",
    "rx_pad": "PAD is not zero",
    "rx_not_for_us": "for another destination",
    "rx_own": "our own source id",
    "rx_dup": "duplicate: heard before",
    "rx_relayed": "for other robots; forwarded",
    "rx_control": "control records only",
    "rx_control_bad": "control entries only, and none is readable",
    "sec_cleartext": "in the clear, where only sealed PDUs count",
    "sec_unknown_kid": "sealed with a key that is not installed here",
    "sec_replay": "a number older than those that count",
    "sec_bad_tag": "sealed with another key, damaged or forged",
    "sec_late": "delayed on its way by more than it says",
    "sec_unproven": "its source has not proven in time that it is alive",
}

RX_REASONS = {
    "rx_partial_timeout": "fragments missing at the end of the reassembly timeout",
    "rx_partial_superseded": "the sender reused the entry id for another message",
    "rx_partial_evicted": "discarded for newer ones: memory limit of the source",
    "rx_partial_memory": "discarded: memory limit of all sources",
    "rx_expired": "its lifespan ended before delivery",
    "rx_no_age": "received without a STAMP, and its topic has a lifespan",
    "rx_size_cap": "larger than the topic's max_bytes",
    "rx_bad_zstd": "its zstd frame is unreadable",
    "rx_inflates": "its zstd frame exceeds the message size limit",
    "rx_no_dictionary": "compressed with a dictionary that this node does not have",
    "rx_bad_cdr": "no room for the four bytes of CDR encapsulation",
    "rx_unknown_topic": "a topic id that our registry does not have, or an undeclared number",
    "rx_part_lost": "a part of a large message is missing",
    "rx_other_type": "its type has other fields here",
    "rx_denied": "from a robot that may not send this topic (from)",
    "rx_outdated": "came after a newer one, as its PDU was sent again (late, deadman_s)",
    "rx_unproven": "from a robot that has not proven to be alive",
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
