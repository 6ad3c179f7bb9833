"""Rate control: chooses the MCS of a burst from the neighbors' reports about us."""

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Annotated, NamedTuple

import msgspec
from msgspec import Meta

from sdrlinkd.link.qos import Qos
from sdrlinkd.wire import BROADCAST, LinkReport

# A PER above HIGH_PER adds to a penalty, and one below LOW_PER reduces it. The penalty is limited,
# because collisions cause losses, too, and slower bursts only collide more.
MAX_PENALTY_DB = 4.0
HIGH_PER, LOW_PER = 0.1, 0.02
PENALTY_STEP_DB = 1.0
PENALTY_DECAY_DB = 0.5
SNR_STEP_DB = 0.25
SWING_WEIGHT = 0.05
"""Weight of the newest burst in the swing of a neighbor's SNR."""
STEADY_DB = 1.0
"""Swing in dB that estimates of a steady SNR have."""
SPREADS = {Qos.URGENT: 6.0, Qos.LATENCY: 2.5, Qos.DEFAULT: 1.5}
"""Standard deviations of a fading SNR that are kept as a further margin; bulk is as default. Urgent
messages are small, and cannot wait to be repeated, so they get as much as there is."""
KEPT_CHANGES = 256


class RateParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Settings of rate control by the neighbors' reports; without it, `modem.mcs` is used."""

    adapt: bool = False
    """Choose the MCS by the neighbors' reports; false: `modem.mcs`, always."""
    min_mcs: Annotated[int, Meta(ge=0, le=9)] = 0
    """Slowest MCS to choose; also the one for a robot whose report is missing."""
    max_mcs: Annotated[int, Meta(ge=0, le=9)] = 9
    """Fastest MCS to choose."""
    margin_db: Annotated[float, Meta(ge=-10, le=40)] = 2.0
    """SNR margin in dB above what an MCS needs, for default and bulk."""
    urgent_margin_db: Annotated[float, Meta(ge=-10, le=40)] = 5.0
    """SNR margin in dB above what an MCS needs, for urgent and latency."""
    hysteresis_db: Annotated[float, Meta(ge=0, le=20)] = 1.5
    """Additional SNR in dB required to change to a faster MCS."""
    stale_s: Annotated[float, Meta(gt=0, le=600)] = 3.0
    """Time in s without a report from a neighbor after which `min_mcs` is used."""
    forget_s: Annotated[float, Meta(gt=0, le=86400)] = 60.0
    """Time in s after which a robot that is not heard no longer limits the MCS."""


class RateChange(NamedTuple):
    """A change, at `at`, of the MCS for bursts to `node`."""

    at: float
    node: int
    mcs: int


class HeardThere(NamedTuple):
    """A neighbor's report about us: SNR in dB and PER, None before its first report; and the MCS
    with which we send to it.
    """

    snr_db: float | None
    per: float | None
    mcs: int


@dataclass(slots=True)
class _Peer:
    """The state of one neighbor, with its last report about us."""

    heard_at: float
    told_at: float = float("-inf")
    snr_db: float = 0.0
    here_db: float | None = None
    swing_db: float = 0.0
    """SNR in dB of its last burst here, and mean change from burst to burst: ours fade as they do.
    The mean of the changes themselves, as one large one, when an obstacle comes, is no fading."""
    per: float = 0.0
    penalty_db: float = 0.0
    chosen: dict[Qos, int] = field(default_factory=dict)

    def note_here(self, snr_db: float) -> None:
        """Note the SNR of one of its bursts."""
        if self.here_db is not None:
            self.swing_db += SWING_WEIGHT * (abs(snr_db - self.here_db) - self.swing_db)
        self.here_db = snr_db

    @property
    def fades_db(self) -> float:
        """About the standard deviation in dB by which its SNR fades."""
        return max(0.0, self.swing_db - STEADY_DB)


class RateControl:
    """Chooses the MCS by neighbor, with hysteresis and a margin by class.

    `needed_snr_db[mcs]` is the SNR in dB that an MCS needs. A broadcast uses the MCS of the worst
    neighbor.
    """

    def __init__(self, params: RateParams, needed_snr_db: tuple[float, ...], fixed: int) -> None:
        self._params = params
        self._needed = needed_snr_db
        self._fixed = min(fixed, len(needed_snr_db) - 1)
        self._highest = min(params.max_mcs, len(needed_snr_db) - 1)
        self._lowest = min(params.min_mcs, self._highest)
        self.adapts = params.adapt
        """Whether the neighbors' reports determine the MCS."""
        self.lowest = self._lowest if params.adapt else self._fixed
        """The MCS of bursts that every robot should be able to read."""
        self.usable = range(self.lowest, (self._highest if params.adapt else self._fixed) + 1)
        """All MCS that may be chosen."""
        self.least_snr_db = needed_snr_db[self.lowest]
        """The SNR in dB that the most robust MCS in use needs."""
        self._peers: dict[int, _Peer] = {}
        self.changes: deque[RateChange] = deque(maxlen=KEPT_CHANGES)
        """Latest changes of the MCS for default and bulk."""

    def heard(self, src: int, now: float, snr_db: float | None = None) -> None:
        """Note that robot `src` was heard at `now`, with this SNR."""
        peer = self._peers.get(src)
        if peer is None:
            peer = self._peers[src] = _Peer(now)
        if snr_db is not None and peer.heard_at != now:
            peer.note_here(snr_db)
        peer.heard_at = now

    def take(self, src: int, report: LinkReport, now: float) -> None:
        """Take the report of robot `src` on how well it hears us."""
        peer = self._peers.setdefault(src, _Peer(now))
        if now - peer.told_at > self._params.stale_s:
            # Earlier losses say nothing about the present.
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
            (self._choose(src, peer, min(qos, Qos.DEFAULT), now) for src, peer in present.items()),
            default=self._lowest,
        )

    def suggested(self, snr_db: float) -> int:
        """The MCS that we suggest to a neighbor that we hear at `snr_db`."""
        return self._best(snr_db - self._params.margin_db)

    def heard_there(self, src: int) -> HeardThere:
        """How robot `src` reports that it hears us, and our last MCS to it for default and bulk."""
        peer = self._peers.get(src)
        if peer is None:
            return HeardThere(None, None, self.lowest)
        mcs = peer.chosen.get(Qos.DEFAULT, self.lowest)
        if peer.told_at < 0:
            return HeardThere(None, None, mcs)
        return HeardThere(peer.snr_db, peer.per, mcs)

    def _choose(self, src: int, peer: _Peer, qos: Qos, now: float) -> int:
        params = self._params
        before = peer.chosen.get(qos, self._lowest)
        if now - peer.told_at > params.stale_s:
            best = self._lowest
        else:
            margin = params.urgent_margin_db if qos <= Qos.LATENCY else params.margin_db
            margin += SPREADS[qos] * peer.fades_db
            usable = peer.snr_db - margin - peer.penalty_db
            best = self._best(usable)
            if best > before:
                best = max(before, self._best(usable - params.hysteresis_db))
        peer.chosen[qos] = best
        if best != before and qos is Qos.DEFAULT:
            self.changes.append(RateChange(now, src, best))
        return best

    def _best(self, snr_db: float) -> int:
        for mcs in range(self._highest, self._lowest, -1):
            if self._needed[mcs] <= snr_db:
                return mcs
        return self._lowest
