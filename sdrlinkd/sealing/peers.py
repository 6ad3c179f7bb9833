"""What is known about each source of sealed PDUs: what it sent already, and how late it is."""

from collections.abc import Callable, Iterator
from functools import partial
from math import inf
from typing import NamedTuple

from sdrlinkd.wire import N_SEQS, TICKS_PER_S

WINDOW_TICKS = 2 * TICKS_PER_S
"""T older than the newest by more than this is refused."""
BUCKET_S = 30.0
SILENT_S = 20.0
"""Time in s without a PDU after which a source must prove anew that it is alive.

If it restarts, its T leaps by more than this. So an attacker who delays all PDUs of its new life by
that leap, to make them look like those of the old one, meets a source that is not proven."""
CHANGED_S = 1.0
"""Change of a lead in s, with a change of key, that shows a clock which has begun anew."""
PROOF_S = 60.0
"""Time in s for which a proof lasts; the drift of two clocks in it is negligible."""


class Window:
    """The numbers opened of one source under one key; `oldest` is the least T that is taken."""

    def __init__(self, oldest: int = 0) -> None:
        self.newest = -1
        self._oldest = oldest
        # By T: a 1 for each seq.
        self._seen: dict[int, bytearray] = {}

    def judge(self, ticks: int, seq: int) -> str:
        """The ledger's reason to refuse a number; empty if it is new."""
        if ticks < self._oldest:
            return "sec_replay"
        seen = self._seen.get(ticks)
        return "rx_dup" if seen is not None and seen[seq] else ""

    def take(self, ticks: int, seq: int) -> None:
        """Note that a PDU with this number was opened."""
        seen = self._seen.get(ticks)
        if seen is not None:
            seen[seq] = 1
            return
        self._seen[ticks] = seen = bytearray(N_SEQS)
        seen[seq] = 1
        if ticks > self.newest:
            self.newest = ticks
            self._oldest = max(self._oldest, ticks - WINDOW_TICKS)
            for each in [each for each in self._seen if each < self._oldest]:
                del self._seen[each]


class Least:
    """The least value of the last 30 to 60 s."""

    def __init__(self) -> None:
        self.until = -inf
        """When the present 30 s end."""
        self.lately = inf
        """The least value in them."""
        self._before = inf
        self.value = inf
        """The least value; infinity if there is none."""
        self.added_at = -inf

    def add(self, value: float, at: float) -> None:
        """Note a value at time `at`."""
        self.added_at = at
        if at >= self.until:
            is_next = at < self.until + BUCKET_S
            self._before, self.lately = (self.lately if is_next else inf), inf
            self.until = at + BUCKET_S
            self.value = self._before
        if value < self.lately:
            self.lately = value
            self.value = min(value, self._before)


class Peers:
    """All sources; `oldest` gives the least T that is taken of each, by kid and source."""

    def __init__(self, oldest: Callable[[int, int], int]) -> None:
        self._oldest = oldest
        self.by_src: dict[int, Peer] = {}
        self.began = -inf
        """When this life of ours began, in s; −inf: that is not known yet."""

    def __iter__(self) -> Iterator[tuple[int, "Peer"]]:
        return iter(self.by_src.items())

    def of(self, src: int) -> "Peer":
        """What is known about robot `src`."""
        peer = self.by_src.get(src)
        if peer is None:
            peer = self.by_src[src] = Peer(partial(self._oldest, src))
        return peer

    def begin(self, now: float) -> None:
        """Note that this life of ours has begun, unless that was noted before."""
        if self.began == -inf:
            self.began = now

    def was_opened(self, src: int) -> bool:
        """Whether a sealed PDU of robot `src` was ever opened in this life."""
        known = self.by_src.get(src)
        return known is not None and any(each.newest >= 0 for each in known.windows.values())

    def change_key(self, kid: int) -> None:
        """Forget the numbers under a kid, which now is another key's."""
        for peer in self.by_src.values():
            peer.windows.pop(kid, None)

    def restart(self) -> None:
        """Forget all proofs and leads, as our own clock begins anew."""
        self.began = -inf
        for peer in self.by_src.values():
            peer.restart()

    def newest(self, kid: int) -> dict[int, int]:
        """The newest T of each source under a key."""
        return {
            src: peer.windows[kid].newest
            for src, peer in self.by_src.items()
            if kid in peer.windows and peer.windows[kid].newest >= 0
        }


class Proof(NamedTuple):
    """A source's word at `at`: its clock is ahead of ours by at most `ahead_s`."""

    ahead_s: float
    at: float


class Peer:
    """One source of sealed PDUs.

    `lead_s` below is the time of a PDU's arrival minus the T in it, in s: how far our clock is
    ahead of the source's, plus the PDU's delay.
    """

    def __init__(self, oldest: Callable[[int], int]) -> None:
        self._oldest = oldest
        self.windows: dict[int, Window] = {}
        """By kid."""
        self.least = Least()
        """The least lead, in s."""
        self.number: bytes | None = None
        """Its number in CONTACT."""
        self.proof: Proof | None = None
        """Its word on its clock, if it was proven when the last PDU was noted."""
        self.first_at = inf
        """When its first PDU since it was proven last, or ever, came, in s."""
        self._kid = -1
        self.contact_at = -inf
        """When its last CONTACT came, in s."""
        self.heard_at = -inf
        """When its last PDU that was in time came, in s."""

    def is_proven(self, now: float) -> bool:
        """Whether it has proven to be alive in this life of ours, and was heard since."""
        proof = self.proof
        return proof is not None and now - self.heard_at < SILENT_S and now - proof.at < PROOF_S

    def window(self, kid: int) -> Window:
        """The numbers opened under a key."""
        window = self.windows.get(kid)
        if window is None:
            window = self.windows[kid] = Window(self._oldest(kid))
        return window

    def note(self, lead_s: float, at: float, kid: int, limit_s: float) -> bool:
        """Note the lead of a PDU that opens at `at`; returns whether a proof has ended.

        A delay of less than `-limit_s` shows that the source's clock has begun anew.
        """
        proof, ended = self.proof, False
        if kid != self._kid:
            # With another key, the source's clock may have begun anew.
            self._kid = kid
            if abs(lead_s - self.least.value) > CHANGED_S:
                ended = proof is not None
                proof = None
                self.restart()
        if proof is not None:
            ahead_s, proven_at = proof
            if lead_s + ahead_s < -limit_s:
                self.restart()
                ended = True
            elif at - self.heard_at >= SILENT_S or at - proven_at >= PROOF_S:
                self.proof, ended = None, True
        least = self.least
        if at < least.until and lead_s >= least.lately:
            # The usual case.
            least.added_at = at
        else:
            least.add(lead_s, at)
        if ended or self.first_at == inf:
            self.first_at = at
        return ended

    def prove(self, proof: Proof) -> None:
        """Note that the source is alive, and how far its clock is ahead of ours."""
        self.proof, self.heard_at = proof, proof.at

    def restart(self) -> None:
        """Forget what depends on the source's clock, which has begun anew."""
        self.proof = None
        self.least = Least()

    def is_late(
        self, lead_s: float, held_s: float, limit_s: float, own_age_s: float, is_judged: bool
    ) -> bool:
        """Whether a PDU's delay differs from `held_s` by more than `limit_s`.

        It also is if the PDU may have been sent before this life of ours began, `own_age_s` ago: an
        earlier one may have heard it. Of a source that is not proven, only the relation to its
        other PDUs is known: a delay of these is found only if it `is_judged`.
        """
        least_s = lead_s - self.least.value - held_s
        if least_s < -limit_s:
            return True
        if not is_judged:
            return False
        proof = self.proof
        if proof is None:
            return least_s > limit_s
        delay_s = lead_s + proof.ahead_s
        return delay_s - held_s > limit_s or delay_s > own_age_s
