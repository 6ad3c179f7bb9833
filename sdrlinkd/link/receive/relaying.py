"""Which PDUs of others are relayed, or kept in case that they are to be relayed."""

from math import inf

from sdrlinkd.link.receive.acceptance import Acceptance
from sdrlinkd.link.receive.ages import Ages
from sdrlinkd.link.receive.door import Admitted
from sdrlinkd.link.receive.duplicates import SequenceTrack
from sdrlinkd.link.receive.pdu_read import PduRead
from sdrlinkd.link.routes import PduToRelay, Routes
from sdrlinkd.link.topics import HeardTopics
from sdrlinkd.wire import BROADCAST, CONTROL_TOPIC_ID, PDU_NUMBERS, Pdu


class Relaying:
    """Turns PDUs that the routes want, or may want, into events."""

    def __init__(
        self, routes: Routes, acceptance: Acceptance, topics: HeardTopics, ages: Ages, *,
        has_control: bool,
    ) -> None:  # fmt: skip
        self._routes = routes
        self._acceptance = acceptance
        self._topics = topics
        self._ages = ages
        self._has_control = has_control

    def judge(
        self, read: PduRead, admitted: Admitted, first_at: float, track: SequenceTrack, *,
        is_ours: bool,
    ) -> PduToRelay | None:  # fmt: skip
        """What becomes of a PDU that was sent first at `first_at`; None: it is not relayed."""
        routes, pdu, at = self._routes, read.pdu, admitted.at
        if not routes.is_on or not admitted.is_proven:
            return None
        is_wanted = routes.wants(pdu, at, is_far=read.is_far)
        if not is_wanted and not routes.may_want(pdu, is_far=read.is_far):
            return None
        until = min(at + routes.lifespan_s, self._fresh_until(pdu))
        number = track.number % PDU_NUMBERS if track.is_numbered else None
        return PduToRelay(
            pdu, admitted.raw, first_at, until, is_ours, number,
            is_spare=not is_wanted, is_bare=not read.has_messages,
        )  # fmt: skip

    def _fresh_until(self, pdu: Pdu) -> float:
        """Time at which all messages in `pdu` will be too old; infinity if unknown, or if one of
        them, not a command, has begun, as it is then finished.
        """
        until = -inf
        for entry in pdu.entries:
            topic_id = entry.topic_id
            if topic_id == CONTROL_TOPIC_ID and self._has_control:
                continue
            origin_at = self._ages.look(pdu.src, topic_id, entry.entry_id).at
            if origin_at is None:
                return inf
            topic = self._topics.topic(pdu.src, topic_id)
            policy = self._acceptance.policy_of(topic, to_one=pdu.dst != BROADCAST)
            if entry.total > 1 and not policy.is_command:
                return inf
            until = max(until, origin_at + policy.own_lifespan_s)
        return until if until > -inf else inf
