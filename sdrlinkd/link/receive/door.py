"""The door for PDUs: opens the sealed ones, and lets those wait whose source is not proven yet."""

from collections import deque
from typing import NamedTuple

from sdrlinkd.errors import PduError
from sdrlinkd.link.receive.acceptance import Acceptance
from sdrlinkd.link.receive.events import Signal
from sdrlinkd.link.receive.neighbors import Neighbors
from sdrlinkd.link.receive.repeated import RepeatedPdus
from sdrlinkd.link.receive.rx_ledger import RxLedger
from sdrlinkd.link.routes import Routes
from sdrlinkd.sealing import InTheClear, Opened, Sealing
from sdrlinkd.wire import SEQ, SRC, is_sealed

WAIT_S = 2.0
"""Time in s for which PDUs wait for the proof of their source, and for which a schedule of a robot
that is not proven is followed."""
_KNOWN = ("rx_dup", "rx_own")
"""Reasons to refuse a PDU that came or left before."""
MOST_WAITING = 512
"""Most PDUs of one source that wait."""


class Admitted(NamedTuple):
    """A PDU for the inbox, in the clear; `raw` is the PDU as it came.

    The preamble of its burst arrived at `at`, and its last sample at `ended_at`. If `is_glance`, it
    waits for the proof of its source, and only its presence counts. If `was_seen`, that was taken
    before.
    """

    data: bytes
    raw: bytes
    at: float
    signal: Signal
    ended_at: float
    is_proven: bool = True
    is_glance: bool = False
    was_seen: bool = False
    may_schedule: bool = True
    """Whether a schedule in it may be followed."""
    ticks: int | None = None
    """The T of a sealed PDU, which distinguishes it from others with its sequence number."""
    is_held: bool = False
    """Whether it was held on its way. Nobody vouches for that, nor for the hops left, so what
    depends on the burst's time does not count then."""
    number: int | None = None
    """The PDU number of one that its source repeats."""
    first_at: float = 0.0
    """When it came, or would have come when it was sent first. Inside a sealed PDU, ages account
    for that."""


class _Waiting(NamedTuple):
    pdu: Admitted
    opened: Opened


class Door:
    """Admits PDUs to the inbox, in order, and counts those that it refuses."""

    def __init__(
        self, sealing: Sealing | InTheClear, acceptance: Acceptance, ledger: RxLedger,
        neighbors: Neighbors, repeated: RepeatedPdus, routes: Routes,
    ) -> None:  # fmt: skip
        self._routes = routes
        self._repeated = repeated
        self._neighbors = neighbors
        self._sealing = sealing
        self._opener = sealing.opener
        self._acceptance = acceptance
        self._ledger = ledger
        self._waiting: dict[int, deque[_Waiting]] = {}
        self._schedules_until: dict[int, float] = {}

    def admit(
        self, data: bytes, at: float, signal: Signal, now: float, ended_at: float
    ) -> list[Admitted]:
        """The PDUs that may be taken now that `data` has come."""
        number, first_at = self._first(data, at)
        is_repeated = number is not None
        pdu = Admitted(
            data, data, at, signal, ended_at, is_held=is_repeated, number=number, first_at=first_at
        )
        if not is_sealed(data):
            if self._opener.refuses_clear(data, now):
                self._refuse("sec_cleartext")
                return []
            return [pdu]
        try:
            opened = self._opener.open(data, at, at - first_at)
        except PduError as error:
            self._refuse(error.reason)
            if error.reason in _KNOWN:
                self._routes.forwarded(data, at)
            neighbor = self._neighbors.get(data[SRC]) if error.reason == "rx_dup" else None
            if neighbor is not None:
                neighbor.count_duplicate()
            return []
        src = opened.src
        pdu = pdu._replace(data=opened.inner, ticks=opened.ticks, is_held=opened.held_s > 0)
        if opened.is_proven:
            self._schedules_until.pop(src, None)
            return [*self._release(src, now), pdu] if src in self._waiting else [pdu]
        unproven = pdu._replace(is_proven=False, may_schedule=self._may_schedule(src, now))
        if self._opener.delivers_unproven or self._acceptance.delivers_unproven:
            return [unproven]
        waiting = self._waiting.setdefault(src, deque())
        waiting.append(_Waiting(pdu, opened))
        if len(waiting) > MOST_WAITING:
            waiting.popleft()
            self._refuse("sec_unproven")
        return [unproven._replace(is_glance=True)]

    def expire(self, now: float) -> None:
        """Drop the PDUs whose sources have not proven to be alive in time."""
        for src in [src for src, each in self._waiting.items() if now - each[0].pdu.at > WAIT_S]:
            waiting = self._waiting[src]
            while waiting and now - waiting[0].pdu.at > WAIT_S:
                waiting.popleft()
                self._refuse("sec_unproven")
            if not waiting:
                del self._waiting[src]

    def _release(self, src: int, now: float) -> list[Admitted]:
        """The PDUs of a source that is proven now, as far as they were not delayed."""
        released = []
        for pdu, opened in self._waiting.pop(src):
            if now - pdu.at > WAIT_S:
                self._refuse("sec_unproven")
            elif self._opener.is_late(src, pdu.at, opened.lead_s, opened.held_s):
                self._refuse("sec_late")
            else:
                released.append(pdu._replace(was_seen=True))
        return released

    def _first(self, data: bytes, at: float) -> tuple[int | None, float]:
        """(number of a PDU that its source repeats, when it would have come at first)."""
        if not self._repeated or len(data) <= SEQ:
            return None, at
        neighbor = self._neighbors.get(data[SRC])
        if neighbor is None:
            return None, at
        return self._repeated.find(data[SRC], data[SEQ], at, neighbor.track) or (None, at)

    def _may_schedule(self, src: int, now: float) -> bool:
        return now < self._schedules_until.setdefault(src, now + WAIT_S)

    def _refuse(self, reason: str) -> None:
        self._ledger.hear()
        self._ledger.drop_pdu(reason)
