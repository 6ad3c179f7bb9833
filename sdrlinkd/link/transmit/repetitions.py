"""Bursts with PDUs that are sent again: which ones, in which slot, and what is said of them."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from sdrlinkd.link.access import Access, Slot, Wish
from sdrlinkd.link.packing import MAX_PDUS, Composer
from sdrlinkd.link.qos import Qos
from sdrlinkd.link.repeat import Answers, RepeatGroup, Wanted
from sdrlinkd.link.traits import Opportunity
from sdrlinkd.link.transmit.burst import Burst
from sdrlinkd.sealing import InTheClear, Sealing
from sdrlinkd.wire import Record


class Planned(NamedTuple):
    """PDUs to be sent again, and the slot for them."""

    group: RepeatGroup
    mcs: int
    slot: Slot
    n_told: int
    """Number of PDUs before them, which say how old they are."""


class Repetitions:
    """Makes bursts of what others lack.

    Our own PDUs come after a PDU that says how old they are, in the same burst if there is room for
    both. Those of others are forwarded again.
    """

    def __init__(self, answers: Answers, composer: Composer, sealing: Sealing | InTheClear) -> None:
        self._answers = answers
        self._composer = composer
        self._sealing = sealing

    def plan(
        self, opportunity: Opportunity, due: Sequence[Wanted], access: Access
    ) -> Planned | None:
        """Which of the PDUs that are `due` to send again, and when; None: none, or not now."""
        earliest, airtime_s, _, sensed, _ = opportunity
        group = self._answers.group(due, earliest, MAX_PDUS - 1)
        if group is None:
            return None
        qos, mcs, n_told = group.qos, group.mcs, 0 if group.is_relayed or group.announced else 1
        slot = access.slot(Wish(earliest, qos, airtime_s(mcs, 1 + n_told), sensed))
        if slot is None and (access.keeps_schedule or access.by_request is not None):
            # Slots may be made for one PDU, or for faster bursts. A turn is made for what we asked,
            # unless it is the one that each robot has for what is urgent.
            mcs = group.kept[0].mcs
            is_asked_for = access.by_request is not None and qos is not Qos.URGENT
            least = 1 + n_told if is_asked_for else 1
            slot = access.slot(Wish(earliest, qos, airtime_s(mcs, least), sensed))
        if slot is None:
            return None
        group = group.alive(slot.start)
        return Planned(group, mcs, slot, n_told) if group.kept else None

    def burst(
        self, planned: Planned, most: int, airtime_s: Callable[[int, int], float],
        ready_at: float | None,
    ) -> Burst | None:  # fmt: skip
        """A burst of at most `most` PDUs as planned, without its number; None: they do not fit.

        The radio could have taken it from `ready_at` on.
        """
        group, mcs, slot, n_told = planned
        start, room_s = slot.start, slot.end - slot.start
        if most < 1 or airtime_s(mcs, 1) > room_s:
            return None
        if n_told and (most < 2 or airtime_s(mcs, 2) > room_s):
            return self._announcement(group.first(most), mcs, slot, airtime_s(mcs, 1))
        group = group.first(min(most - n_told, group.announced or MAX_PDUS))
        if group.is_relayed:
            forwarded = self._composer.forwarded
            pdus = [forwarded(kept.octets, start - kept.first_at) for kept in group.kept]
        else:
            pdus = []
            if n_told:
                repeats, group = group.told(start, self._composer.k_single)
                pdus = self._made(repeats, start)
            pdus += [kept.octets for kept in group.kept]
        length_s = airtime_s(mcs, len(pdus))
        self._answers.took(group, start, length_s)
        return Burst(
            pdus,
            [[] for _ in pdus],
            [group.qos] * len(pdus),
            mcs,
            group.qos,
            start,
            max(start, slot.late_end - length_s),
            length_s,
            first_start=start,
            ready_at=start if ready_at is None else ready_at,
            n_timed=len(pdus) if group.is_relayed else n_told,
            repeated=group,
        )

    def _announcement(self, group: RepeatGroup, mcs: int, slot: Slot, length_s: float) -> Burst:
        """A burst of a PDU that announces others, where there is no room for both."""
        start = slot.start
        repeats, group = group.told(start, self._composer.k_single)
        number = self._composer.next_number
        pdus = self._made(repeats, start)
        self._answers.announced(group, start, length_s)
        return Burst(
            pdus, [[]], [group.qos], mcs, group.qos, start, max(start, slot.late_end - length_s),
            length_s, first_start=start, n_records=1, ready_at=start, n_timed=1, numbers=[number],
        )  # fmt: skip

    def _made(self, records: Sequence[Record], start: float) -> list[bytes]:
        """A PDU with these records, for the air."""
        pdus = [pdu.data for pdu in self._composer.fill_with_only(records)]
        return [self._sealing.seal(pdu, start) for pdu in pdus] if self._sealing.is_on else pdus
