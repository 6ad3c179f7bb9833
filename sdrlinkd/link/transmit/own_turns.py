"""What a robot does in its turns, where the access policy gives them by request (`grant`).

It tells the robot that plans what waits, and what it expects soon. It fills its own turns: the
records of the policy go first, as others wait for them, but nothing takes room from an urgent
message that fits.
"""

from collections.abc import Callable, Mapping
from math import inf

from sdrlinkd.link.access import ALMOST_S, ByRequest, Due, Slot, Waiting, together
from sdrlinkd.link.packing import BuiltPdu, Composer, PiggybackRecords
from sdrlinkd.link.qos import MIDDLE_PRIORITY, Qos
from sdrlinkd.link.queue import Outbox
from sdrlinkd.link.repeat import Answers
from sdrlinkd.link.schedule import Allowance, Forecasts
from sdrlinkd.link.transmit.control_records import ControlRecords
from sdrlinkd.link.transmit.fit import Fit
from sdrlinkd.wire import BROADCAST, RecordType

MOST_REPEATED = 8
"""Most PDUs to repeat for which air is requested at a time."""

AirtimeOf = Callable[[int], float]
"""The airtime in s of a burst of so many PDUs."""


class OwnTurns:
    """Requests air for what waits here, and fills the turns that are given for it."""

    def __init__(
        self, access: ByRequest, fit: Fit, outbox: Outbox, composer: Composer,
        control_records: ControlRecords, piggyback: PiggybackRecords, forecasts: Forecasts,
        answers: Answers, own_id: int,
    ) -> None:  # fmt: skip
        self._answers = answers
        self._fit = fit
        self._access = access
        self._outbox = outbox
        self._composer = composer
        self._control_records = control_records
        self._piggyback = piggyback
        self._forecasts = forecasts
        self._own_id = own_id
        self._only_told = False
        """Whether our last burst held records and no message."""

    def waiting(self, now: float, airtime_s: AirtimeOf) -> Waiting | None:
        """What waits here at `now`, to be sent or repeated, with its airtime; None: nothing."""
        head, found = self._outbox.next_message, None
        if head is not None:
            k, age_s = self._composer.k_single, max(0.0, now - head.arrived_at)
            waiting = {qos: -(-n // k) for qos, n in self._outbox.waiting_bytes().items()}
            found = self._needing(head.qos, head.priority, age_s, waiting, airtime_s)
        if not self._answers.wanted:
            return found
        due = self._answers.due(now, self._composer.next_number)
        if not due:
            return found
        again_s = self.repeats_s(airtime_s)
        return together(found, Waiting(due[0].kept.qos, MIDDLE_PRIORITY, 0.0, again_s))

    def repeats_s(self, airtime_s: AirtimeOf) -> float:
        """Airtime in s for what is to be repeated, with a PDU that says how old it is."""
        return airtime_s(1 + min(len(self._answers.wanted), MOST_REPEATED))

    def dues(self, now: float, airtime_s: AirtimeOf) -> tuple[Due, ...]:
        """The next urgent messages of the team that can be predicted and come soon, in order."""
        if not self._access.plans:
            return ()
        fit, each_s = self._fit, airtime_s(2) - airtime_s(1)
        # When its robot surely has it, and can still decide to send it then.
        after_s = fit.notice_s + fit.lead_s
        return tuple(
            Due(
                node,
                forecast.qos,
                forecast.due(now) + forecast.spread_s + after_s,
                airtime_s(1) + each_s * (forecast.n_pdus - 1),
            )
            for node, forecast in self._forecasts.of_team(now, now + 2 * self._access.round_s)
        )

    def asks_at(self, earliest: float) -> float:
        """From `earliest` on, when to ask for what will come soon; infinity: nothing will."""
        at = self._access.turn_at(earliest)
        return at if at < inf and self._soon(at) else inf

    def fill(
        self,
        slot: Slot,
        allowance: Allowance,
        airtime_s: AirtimeOf,
        waiting: Waiting | None,
        *,
        cannot_wait: bool,
    ) -> tuple[list[BuiltPdu], int]:
        """(PDUs, how many of them hold only records) of a burst in `slot`.

        `waiting` is what waits before it. `cannot_wait`: records other than those of the policy are
        overdue.
        """
        start, longest_s = slot.start, slot.end - slot.start
        access, composer, records = self._access, self._composer, self._control_records
        left = None if waiting is None else waiting.without(longest_s)
        want = access.request(start, together(left, self._coming(start, airtime_s)))
        is_full = self._is_full(waiting, longest_s, airtime_s)
        asks = (want is not None or cannot_wait) and not is_full
        # The root gives two PDUs to those on which it counts to pass its plan on. At others, an
        # urgent message goes before the plan every other time.
        may_wait = is_full and self._only_told and longest_s < airtime_s(2) and not access.plans
        tells = access.must_tell and not may_wait
        is_idle = not self._outbox.levels and records.is_due(start)
        if not (tells or asks or is_idle):
            if want is not None:
                self._piggyback.put_as((RecordType.WANT,), want, inf)
            built = composer.fill(start, allowance, is_mixed=True)
            if want is not None and not self._piggyback.take_back((RecordType.WANT,)):
                access.requested(want, start)
            # Others wait for the plan, even if a message here waits to share its PDU.
            if built or not access.plans:
                self._only_told = False
                return built, 0
        number, key = composer.take_number(), records.told_in_clear(start)
        n_records = 1 + (key is not None)
        built = composer.fill(start, allowance.fewer(n_records), is_mixed=True)
        length_s = airtime_s(len(built) + n_records)
        told = access.told(start, length_s, composer.k_single)
        left = self.waiting(start, airtime_s)
        want = access.request(start, together(left, self._coming(start, airtime_s)))
        if want is not None:
            told.append(want)
            access.requested(want, start)
        self._only_told = not built
        alone = composer.fill_with_records(start, told, number)
        return [*alone, *built, *([] if key is None else [key])], n_records

    def _coming(self, now: float, airtime_s: AirtimeOf) -> Waiting | None:
        """What will probably come before a request made at `now` is granted; None: nothing."""
        coming = self._soon(now)
        return self._needing(min(coming), 0, 0.0, coming, airtime_s) if coming else None

    def _soon(self, now: float) -> Mapping[Qos, int]:
        """PDUs by class that will come before a request made at `now` is granted.

        The robot that plans expects what it has heard directly by itself.
        """
        access = self._access
        end = now + access.ahead_s
        return self._forecasts.coming(self._own_id, now, end, is_relayed=not access.is_far)

    def _needing(
        self, qos: Qos, priority: int, age_s: float, n_pdus: Mapping[Qos, int],
        airtime_s: AirtimeOf,
    ) -> Waiting:  # fmt: skip
        """Messages that need `n_pdus` by class, of which the most urgent has class `qos`."""
        one_s = airtime_s(1)
        each_s = airtime_s(2) - one_s
        air_s = {each: each_s * n for each, n in n_pdus.items()}
        lower_s = sum(needs_s for each, needs_s in air_s.items() if each > qos)
        return Waiting(qos, priority, age_s, max(air_s.get(qos, 0.0), one_s), lower_s)

    def _is_full(self, waiting: Waiting | None, longest_s: float, airtime_s: AirtimeOf) -> bool:
        """Whether urgent messages need all of a burst, so that records wait for another turn.

        If they do not fit anyway, a request for more comes first, unless it fits beside one. In
        turns of one PDU, messages and requests take turns: what is asked for may never come.
        """
        if waiting is None or waiting.qos > Qos.LATENCY:
            return False
        one_s, two_s = airtime_s(1), airtime_s(2)
        if waiting.air_s <= longest_s + ALMOST_S < waiting.air_s + two_s - one_s:
            return True
        head = self._outbox.next_message
        is_to_all = head is not None and head.dst == BROADCAST and not head.is_whole
        return longest_s < two_s and (is_to_all or self._only_told)
