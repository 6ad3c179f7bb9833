"""What became of messages: those that came from others, and those whose producers want to know."""

from collections.abc import Mapping

from sdrlinkd.link.queue import TopicPolicy
from sdrlinkd.link.receipts.receipts import Receipts, Verdict, make_receipt
from sdrlinkd.link.receive import Deadman, Delivered, Latency, Neighbor
from sdrlinkd.link.transmit import PRESENT_S, ControlRecords, Sender
from sdrlinkd.wire import BROADCAST, Receipt


class Delivery:
    """Latencies by (source, topic id), receipts both ways, and who fell silent."""

    def __init__(
        self,
        sender: Sender,
        control_records: ControlRecords,
        neighbors: Mapping[int, Neighbor],
        own_id: int,
        receipt_s: float,
    ) -> None:
        self._sender = sender
        self._control_records = control_records
        self._neighbors = neighbors
        self._own_id = own_id
        self.latencies: dict[tuple[int, int], Latency] = {}
        self.receipts = Receipts(receipt_s)
        self.deadman = Deadman()
        self.receipts_untold = 0
        """RECEIPTs of ours that found no room."""

    def delivered(self, message: Delivered, policy: TopicPolicy, now: float) -> float | None:
        """The age in seconds at which `message` is handed over at `now`; None when unknown."""
        src, topic_id = key = message.src, message.topic_id
        if policy.deadman_s:
            self.deadman.fresh(src, topic_id, now, policy.deadman_s)
        if message.origin_at is None:
            return None
        latency = self.latencies.get(key)
        if latency is None:
            latency = self.latencies[key] = Latency()
        return latency.add(message.parts(now), now)

    def ended(
        self, src: int, topic_id: int, entry_id: int, reason: str, age_s: float | None, now: float
    ) -> None:
        """Another robot wants to know of its message."""
        receipt = make_receipt(src, topic_id, entry_id, reason, age_s)
        self.receipts_untold += not self._control_records.receipt(receipt, now)

    def answered(self, src: int, receipt: Receipt, at: float) -> None:
        """Another robot tells of ours."""
        if receipt.node in (self._own_id, BROADCAST):
            self.receipts.hear(src, receipt, at)

    def refuse(
        self, reason: str, topic_id: int | None, receipt: str, dst: int | None = None
    ) -> None:
        """A message that the bus could not hand over."""
        self._sender.refuse(reason, topic_id)
        if receipt and topic_id is not None:
            self.refused(receipt, topic_id, reason, dst)

    def refused(self, receipt: str, topic_id: int, reason: str, dst: int | None) -> None:
        """A message that was not taken."""
        self._verdict(receipt, topic_id, dst, "dropped", reason)

    def unknowable(self, receipt: str, topic_id: int, dst: int | None) -> None:
        """A message that nobody can answer for want of a control channel."""
        self._verdict(receipt, topic_id, dst, "unknown", "")

    def _verdict(
        self, receipt: str, topic_id: int, dst: int | None, fate: str, reason: str
    ) -> None:
        if dst is None:
            dst = self._sender.destination(topic_id)
        self.receipts.verdicts.append(Verdict(receipt, topic_id, dst, fate, reason))

    def note(self, now: float) -> None:
        """What has just been sent, or dropped."""
        asking, dropped = self._sender.packetizer.asking, self._sender.lives.dropped_asking
        if asking:
            present = [
                each.src
                for each in self._neighbors.values()
                if each.src != self._own_id and now - each.last_heard_at < PRESENT_S
            ]
            for message in asking:
                self.receipts.expect(message, present, now)
            asking.clear()
        for message, reason in dropped:
            self.receipts.dropped(message, reason)
        dropped.clear()

    def expire(self, now: float) -> None:
        """Let time pass."""
        self.note(now)
        self.receipts.expire(now)
