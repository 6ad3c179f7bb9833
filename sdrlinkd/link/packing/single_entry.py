"""PDUs with a single content: another robot's PDU, or one fragment that fills the PDU."""

from sdrlinkd.link.packing.draft import BuiltPdu
from sdrlinkd.link.params import LinkParams
from sdrlinkd.link.qos import WIRE_BITS
from sdrlinkd.link.queue import Lane, Outbox, Outgoing
from sdrlinkd.wire import build_full, equal_payload, flags, relayed


class SingleEntry:
    """Builds PDUs that need no packing decisions."""

    def __init__(self, outbox: Outbox, params: LinkParams, src: int, has_control: bool) -> None:
        self._outbox = outbox
        self._k = equal_payload(params.pdu_size, 1)
        self._hop_limit = params.hop_limit
        self._src = src
        self._has_control = has_control

    def relayed(self, head: Outgoing, start: float) -> BuiltPdu:
        """Another robot's PDU `head`, taken from the head of its lane."""
        lane = head.lane
        self._outbox.begin(lane, 0, 0, 1, start)
        head.advance(1, start)
        self._outbox.end(lane)
        self._outbox.served(lane, len(head.payload))
        return BuiltPdu(self.forwarded(head.payload, start - head.arrived_at), [head], head.qos)

    def forwarded(self, pdu: bytes, held_s: float) -> bytes:
        """Another robot's PDU, which came `held_s` before, with one hop less."""
        return relayed(pdu, max(0, round(1e6 * held_s)), self._has_control)

    def fills_some(self, head: Outgoing) -> bool:
        """Whether the next fragment of `head` fills a PDU and is not the last one."""
        # The last fragment differs: it may need a STAMP and may leave room.
        k = head.k
        return (
            k == self._k - head.overhead
            and not head.needs_id
            and (len(head.body) - 1) // k > head.next_index
        )

    def filled(self, lane: Lane, start: float, seq: int, most: int) -> list[BuiltPdu]:
        """PDUs with the next fragments, `most` or fewer, of the message that `lane` has begun.

        Requires that the lane is alone in its level, and that the next fragment fills a PDU.
        """
        head = lane.current
        if head is None:
            return []
        body, first, k = head.body, head.next_index, head.k
        n = min(most, (len(body) - 1) // k - first)
        bits, qos = flags(WIRE_BITS[head.qos], head.is_compressed), head.qos
        built = [
            BuiltPdu(
                build_full(
                    bits, self._src, head.dst, (seq + i) & 0xFF, self._hop_limit, head.channel,
                    head.entry_id, first + i, head.total, body[at : at + k],
                ),
                [head],
                qos,
            )
            for i, at in enumerate(range(first * k, (first + n) * k, k))
        ]  # fmt: skip
        head.advance(n, start)
        self._outbox.served(lane, n * (k + head.overhead))
        return built
