"""Matches RECEIPT records to messages, and makes the verdicts for their producers."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

from sdrlinkd.link.queue import Outgoing
from sdrlinkd.link.receive import DELIVERED
from sdrlinkd.wire import BROADCAST, NO_AGE, RECEIPT_UNIT_S, Receipt, octet

EARLIER_S = 0.05
"""Tolerance in s for a receipt that implies too early a submission of its message."""
MOST_PENDING = 4096
REASONS = (
    DELIVERED, "rx_expired", "rx_partial_timeout", "rx_partial_superseded", "rx_partial_evicted",
    "rx_partial_memory", "rx_size_cap", "rx_bad_zstd", "rx_inflates", "rx_no_dictionary",
    "rx_bad_cdr", "rx_unknown_topic", "rx_no_age", "rx_part_lost", "rx_other_type",
    "rx_unproven", "rx_denied", "rx_outdated",
)  # fmt: skip
"""Reasons by status, from 1 (wire document, section 6.7)."""
STATUS = {reason: number for number, reason in enumerate(REASONS, 1)}
EXPIRED = ("rx_expired", "tx_expired")


class Verdict(NamedTuple):
    """What became of a message at robot `dst`: `fate` is delivered, expired, dropped or unknown.

    `took_s` is the message's age in s at its delivery, None if unknown. `left` is the number of
    robots that have not answered yet, and `repeats` counts the PDUs with parts of it that were sent
    again.
    """

    receipt: str
    topic_id: int
    dst: int
    fate: str
    reason: str = ""
    took_s: float | None = None
    left: int = 0
    repeats: int = 0


@dataclass(slots=True)
class _Pending:
    message: Outgoing
    until: float
    awaited: set[int]


def make_receipt(
    src: int, topic_id: int, entry_id: int, reason: str, age_s: float | None
) -> Receipt:
    """The RECEIPT record for robot `src` about its message."""
    age = NO_AGE if age_s is None else min(max(round(age_s / RECEIPT_UNIT_S), 0), NO_AGE)
    return Receipt(octet(topic_id), entry_id, STATUS[reason], src, age)


class Receipts:
    """Outstanding receipts at the sender; each robot asked yields exactly one verdict."""

    def __init__(self, own_id: int, timeout_s: float) -> None:
        self._own_id = own_id
        self._timeout_s = timeout_s
        self._pending: dict[tuple[int, int], list[_Pending]] = {}
        self._n_pending = 0
        self._verdicts: list[Verdict] = []
        self.unasked = 0
        """RECEIPT records received for messages that no longer await one."""

    def expect(self, message: Outgoing, present: Iterable[int], now: float) -> None:
        """Await receipts for a message in a burst at `now`; for a broadcast, from all `present`."""
        message.expect()
        awaited = set(present) if message.dst == BROADCAST else {message.dst}
        pending = _Pending(message, now + self._timeout_s, awaited or {BROADCAST})
        if self._n_pending >= MOST_PENDING:
            self._give_up(pending)
            return
        key = _key(message)
        self._pending.setdefault(key, []).append(pending)
        self._n_pending += 1

    def hear(self, src: int, receipt: Receipt, at: float) -> None:
        """Take a RECEIPT of robot `src`, in a burst whose preamble came at `at`.

        A RECEIPT names the robot that sent the message. If it names none (BROADCAST), that robot is
        the destination of the PDU.
        """
        if receipt.node not in (self._own_id, BROADCAST):
            return
        age_s = None if receipt.age_100us == NO_AGE else RECEIPT_UNIT_S * receipt.age_100us
        ended_at = at - RECEIPT_UNIT_S * receipt.since_100us
        # Entry ids repeat: the RECEIPT is for the latest message that fits its times.
        latest = ended_at + EARLIER_S - (age_s or 0.0)
        for pending in reversed(self._pending.get((receipt.topic_id, receipt.entry_id), ())):
            if pending.message.arrived_at > latest:
                continue
            if src not in pending.awaited:
                break
            pending.awaited.discard(src)
            known = receipt.status <= len(REASONS) and receipt.status
            reason = REASONS[receipt.status - 1] if known else f"rx_status_{receipt.status}"
            self._tell(pending.message, src, reason, age_s, len(pending.awaited))
            if not pending.awaited:
                self._forget(pending)
            return
        self.unasked += 1

    def dropped(self, message: Outgoing, reason: str) -> None:
        """Make the verdicts for a message that was not sent, or not completely."""
        for pending in self._pending.get(_key(message), ()):
            if pending.message is message:
                for left, dst in _counted_down(pending.awaited):
                    self._tell(message, dst, reason, None, left)
                self._forget(pending)
                return
        if not message.is_expected:
            self._tell(message, message.dst, reason, None)

    def expire(self, now: float) -> None:
        """Make the verdict `unknown` for robots that have not answered within the timeout."""
        if not self._n_pending:
            return
        late = [each for of in self._pending.values() for each in of if each.until <= now]
        for pending in late:
            self._give_up(pending)
            self._forget(pending)

    def refused(self, receipt: str, topic_id: int, dst: int, reason: str) -> None:
        """Make the verdict for a message that was refused."""
        self._verdicts.append(Verdict(receipt, topic_id, dst, "dropped", reason))

    def unknowable(self, receipt: str, topic_id: int, dst: int) -> None:
        """Make the verdict `unknown` for a message sent without a control channel."""
        self._verdicts.append(Verdict(receipt, topic_id, dst, "unknown"))

    def take(self) -> list[Verdict]:
        """The verdicts since the last call, for the producers."""
        verdicts = self._verdicts
        if verdicts:
            self._verdicts = []
        return verdicts

    def _tell(
        self, message: Outgoing, dst: int, reason: str, age_s: float | None, left: int = 0
    ) -> None:
        fate = "dropped"
        if reason == DELIVERED:
            fate, reason = DELIVERED, ""
        elif reason in EXPIRED:
            fate = "expired"
        self._verdicts.append(_verdict(message, dst, fate, reason, age_s, left))

    def _give_up(self, pending: _Pending) -> None:
        self._verdicts += [
            _verdict(pending.message, dst, "unknown", "", None, left)
            for left, dst in _counted_down(pending.awaited)
        ]

    def _forget(self, pending: _Pending) -> None:
        key = _key(pending.message)
        left = [each for each in self._pending[key] if each is not pending]
        self._n_pending -= 1
        if left:
            self._pending[key] = left
        else:
            del self._pending[key]


def _verdict(
    message: Outgoing, dst: int, fate: str, reason: str, age_s: float | None, left: int
) -> Verdict:
    ids = message.receipt, message.topic_id
    return Verdict(*ids, dst, fate, reason, age_s, left, message.n_repeats)


def _key(message: Outgoing) -> tuple[int, int]:
    """What identifies a message in RECEIPT records, for as long as its entry id rests."""
    return octet(message.channel), message.entry_id


def _counted_down(robots: set[int]) -> Iterable[tuple[int, int]]:
    """Pairs of (number of robots that follow, robot)."""
    return zip(range(len(robots) - 1, -1, -1), sorted(robots), strict=True)
