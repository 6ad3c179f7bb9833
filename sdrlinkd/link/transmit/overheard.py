"""Uses others' traffic for our own: for access, rate control, and forecasts."""

from collections.abc import Callable

from sdrlinkd.link.paths import HALF_BELOW_DB
from sdrlinkd.link.qos import CLASSES, Qos
from sdrlinkd.link.receive import PduHeard
from sdrlinkd.link.schedule import Flow, Forecasts
from sdrlinkd.link.transmit.fit import Fit
from sdrlinkd.link.transmit.motion import Motion
from sdrlinkd.link.transmit.rate import SNR_STEP_DB
from sdrlinkd.wire import CONTROL_TOPIC_ID, Beacon, Frame, Grant, LinkReport, Pdu, Record, Want

Knows = Callable[[int, float], bool]
"""Whether a robot is one of the team: it is in access.nodes, or hears us, too."""


class Overheard:
    """Passes what was heard to the access policy, to rate and burst control, and the forecasts."""

    def __init__(
        self, fit: Fit, forecasts: Forecasts, motion: Motion, own_id: int, has_control: bool,
        knows: Knows,
    ) -> None:  # fmt: skip
        self._knows = knows
        self._motion = motion
        self._access, self._rate = fit.settled.access, fit.rate
        self._forecasts = forecasts
        self._own_id = own_id
        self._has_control = has_control
        self._is_weak = False
        """Whether most PDUs get lost with the signal of the last one, whose records come next."""

    def pdu(self, event: PduHeard) -> None:
        """Note a valid PDU that another robot has sent."""
        pdu, stamps, at, is_relayed, (snr_db, doppler_hz) = event
        src = pdu.src
        self._is_weak = snr_db is not None and self._too_weak(snr_db)
        self._access.heard(src, at, is_relayed, is_weak=self._is_weak)
        if not is_relayed and self._knows(src, at):
            self._rate.heard(src, at, snr_db)
            if doppler_hz is not None:
                self._motion.note(src, doppler_hz, at)
        qos = CLASSES[pdu.qos]
        by_request = self._access.by_request is not None
        uses = self._access.others_follow or (by_request and not is_relayed)
        if not uses or qos > Qos.LATENCY or src == self._own_id:
            return
        # Periodic urgent messages of others need the channel at their times, too.
        ages = {} if is_relayed else {(each.topic_id, each.entry_id): each for each in stamps}
        for entry in pdu.entries:
            stamp = ages.get((entry.topic_id, entry.entry_id))
            # The age of a large message comes with its last fragment.
            is_first = stamp is not None if by_request else not entry.index
            if is_first and not (entry.topic_id == CONTROL_TOPIC_ID and self._has_control):
                origin = at if stamp is None else at - 1e-6 * stamp.age_us
                flow = Flow(src, src, entry.topic_id)
                self._forecasts.note(flow, qos, origin, max(1, entry.total))

    def forwarding(self, pdu: Pdu, at: float) -> None:
        """Note a PDU that we forward: we can ask for the air for the next one in advance."""
        if self._access.by_request is None:
            return
        for entry in pdu.entries:
            if not entry.index and entry.total:
                flow = Flow(self._own_id, pdu.src, entry.topic_id)
                self._forecasts.note(flow, CLASSES[pdu.qos], at, entry.total)

    def record(self, src: int, record: Record, at: float) -> None:
        """Note a record of robot `src` on whom it hears, its presence, or its schedule."""
        if isinstance(record, LinkReport):
            if record.node == self._own_id:
                if self._knows(src, at):
                    self._rate.take(src, record, at)
            else:
                snr_db = SNR_STEP_DB * record.snr_quarter_db
                self._access.told_of(record.node, at, src, is_weak=self._too_weak(snr_db))
        elif isinstance(record, Beacon):
            self._access.beacon(src, at)
        elif isinstance(record, Frame):
            self._access.take_frame(src, record, at)
        elif isinstance(record, Grant):
            self._access.take_grant(src, record, at, is_weak=self._is_weak)
        elif isinstance(record, Want):
            self._access.take_want(src, record, at)

    def _too_weak(self, snr_db: float) -> bool:
        """Whether most PDUs with the most robust MCS in use get lost with such a signal."""
        return snr_db < self._rate.least_snr_db - HALF_BELOW_DB
