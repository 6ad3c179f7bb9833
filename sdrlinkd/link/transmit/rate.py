"""Which MCS a burst gets: from what the neighbors say of us."""

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Annotated, NamedTuple

import msgspec
from msgspec import Meta

from sdrlinkd.link.qos import Qos
from sdrlinkd.wire import BROADCAST, LinkReport

# More loss than this is answered by caution, less than that takes it back. Not by much: collisions
# are losses, too, and slower bursts only collide more.
MAX_PENALTY_DB = 4.0
HIGH_PER, LOW_PER = 0.1, 0.02
PENALTY_STEP_DB = 1.0
PENALTY_DECAY_DB = 0.5
SNR_STEP_DB = 0.25
KEPT_CHANGES = 256


class RateParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Choice of the MCS by what the neighbors report; else `modem.mcs` stays."""

    adapt: bool = False
    min_mcs: Annotated[int, Meta(ge=0, le=9)] = 0
    max_mcs: Annotated[int, Meta(ge=0, le=9)] = 9
    margin_db: Annotated[float, Meta(ge=-10, le=40)] = 2.0
    """SNR kept in hand over what an MCS needs."""
    urgent_margin_db: Annotated[float, Meta(ge=-10, le=40)] = 5.0
    """The same for urgent and latency."""
    hysteresis_db: Annotated[float, Meta(ge=0, le=20)] = 1.5
    """An MCS is left upwards only with so much more."""
    stale_s: Annotated[float, Meta(gt=0, le=600)] = 3.0
    """Without a report for so long, `min_mcs` it is."""
    forget_s: Annotated[float, Meta(gt=0, le=86400)] = 60.0
    """A robot not heard for so long holds nobody back."""


class RateChange(NamedTuple):
    """At `at`, bursts that `node` must read went over to `mcs`."""

    at: float
    node: int
    mcs: int


class HeardThere(NamedTuple):
    """A neighbor's word of us: SNR in dB and PER, None while it has told nothing; and what we send
    to it with.
    """

    snr_db: float | None
    per: float | None
    mcs: int


@dataclass(slots=True)
class _Peer:
    """What one neighbor says of us."""

    heard_at: float
    told_at: float = float("-inf")
    snr_db: float = 0.0
    per: float = 0.0
    penalty_db: float = 0.0
    chosen: dict[bool, int] = field(default_factory=dict)


class RateControl:
    """MCS by neighbor, with hysteresis and a margin by class.

    `needed_snr_db[mcs]` is what each MCS needs. A broadcast suits the worst neighbor.
    """

    def __init__(self, params: RateParams, needed_snr_db: tuple[float, ...], fixed: int) -> None:
        self._params = params
        self._needed = needed_snr_db
        self._fixed = min(fixed, len(needed_snr_db) - 1)
        self._highest = min(params.max_mcs, len(needed_snr_db) - 1)
        self._lowest = min(params.min_mcs, self._highest)
        self.adapts = params.adapt
        """Whether reports decide."""
        self.lowest = self._lowest if params.adapt else self._fixed
        """The MCS of what everybody should be able to read."""
        self.usable = range(self.lowest, (self._highest if params.adapt else self._fixed) + 1)
        """The MCS that may be chosen."""
        self._peers: dict[int, _Peer] = {}
        self.changes: deque[RateChange] = deque(maxlen=KEPT_CHANGES)
        """The last ones, for default and bulk."""

    def heard(self, src: int, now: float) -> None:
        """Note that robot `src` was heard at `now`."""
        peer = self._peers.get(src)
        if peer is None:
            self._peers[src] = _Peer(now)
        else:
            peer.heard_at = now

    def take(self, src: int, report: LinkReport, now: float) -> None:
        """Take the report of robot `src` on how well it hears us."""
        peer = self._peers.setdefault(src, _Peer(now))
        if now - peer.told_at > self._params.stale_s:
            # What went wrong before tells nothing of now.
            peer.penalty_db = 0.0
        peer.told_at = now
        peer.snr_db = SNR_STEP_DB * report.snr_quarter_db
        peer.per = report.per_255 / 255
        if peer.per > HIGH_PER:
            peer.penalty_db = min(MAX_PENALTY_DB, peer.penalty_db + PENALTY_STEP_DB)
        elif peer.per < LOW_PER:
            peer.penalty_db = max(0.0, peer.penalty_db - PENALTY_DECAY_DB)

    def mcs(self, destinations: Iterable[int], qos: Qos, now: float) -> int:
        """The MCS for a burst to `destinations` that leaves at `now`."""
        if not self.adapts:
            return self._fixed
        wanted = set(destinations)
        present = {
            src: peer
            for src, peer in self._peers.items()
            if now - peer.heard_at < self._params.forget_s
        }
        if BROADCAST not in wanted:
            present = {src: peer for src, peer in present.items() if src in wanted}
        return min(
            (self._choose(src, peer, qos <= Qos.LATENCY, now) for src, peer in present.items()),
            default=self._lowest,
        )

    def suggested(self, snr_db: float) -> int:
        """The MCS that we would like a neighbor heard at `snr_db` to send with."""
        return self._best(snr_db - self._params.margin_db)

    def heard_there(self, src: int) -> HeardThere:
        """How robot `src` says it hears us, and the MCS last used for it, for default and bulk."""
        peer = self._peers.get(src)
        if peer is None:
            return HeardThere(None, None, self.lowest)
        mcs = peer.chosen.get(False, self.lowest)
        if peer.told_at < 0:
            return HeardThere(None, None, mcs)
        return HeardThere(peer.snr_db, peer.per, mcs)

    def _choose(self, src: int, peer: _Peer, is_urgent: bool, now: float) -> int:
        params = self._params
        before = peer.chosen.get(is_urgent, self._lowest)
        if now - peer.told_at > params.stale_s:
            best = self._lowest
        else:
            margin = params.urgent_margin_db if is_urgent else params.margin_db
            usable = peer.snr_db - margin - peer.penalty_db
            best = self._best(usable)
            if best > before:
                best = max(before, self._best(usable - params.hysteresis_db))
        peer.chosen[is_urgent] = best
        if best != before and not is_urgent:
            self.changes.append(RateChange(now, src, best))
        return best

    def _best(self, snr_db: float) -> int:
        for mcs in range(self._highest, self._lowest, -1):
            if self._needed[mcs] <= snr_db:
                return mcs
        return self._lowest
