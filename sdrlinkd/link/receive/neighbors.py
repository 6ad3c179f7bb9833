"""Who is heard, how well, and whether both mean the same by a topic id."""

from dataclasses import dataclass, field

from sdrlinkd.link.receive.duplicates import SequenceTrack
from sdrlinkd.wire import Beacon, Registry, RegistryDigest

# Weight of the newest PDU in the mean SNR.
SNR_WEIGHT = 0.2
GAP_DECAY = 0.98
LONGEST_GAP_S = 16.0
"""A half-duplex robot that has nothing to say is heard this often."""


@dataclass(slots=True)
class Neighbor:
    """One source of PDUs."""

    src: int
    track: SequenceTrack = field(default_factory=SequenceTrack)
    heard: int = 0
    duplicates: int = 0
    last_heard_at: float = 0.0
    usual_gap_s: float = 0.0
    """The longest pause between its PDUs lately."""
    hops_left: int = 0
    snr_db: float | None = None
    mean_snr_db: float | None = None
    boot_id: int | None = None
    reboots: int = 0
    digest: RegistryDigest | None = None
    _reported: tuple[int, int] = (0, 0)

    def heard_at(self, at: float) -> None:
        """One more PDU came."""
        if self.last_heard_at:
            # A pause is forgotten after some hundred PDUs without one as long; an outage is none.
            gap_s = min(at - self.last_heard_at, LONGEST_GAP_S)
            self.usual_gap_s = max(gap_s, GAP_DECAY * self.usual_gap_s)
        self.last_heard_at = at

    def note_snr(self, snr_db: float | None) -> None:
        """SNR of one more PDU."""
        self.snr_db = snr_db
        if snr_db is None or self.mean_snr_db is None:
            self.mean_snr_db = snr_db
        else:
            self.mean_snr_db += SNR_WEIGHT * (snr_db - self.mean_snr_db)

    def take_quality(self) -> tuple[float, float] | None:
        """(mean SNR in dB, share of PDUs lost since the last call); None: nothing was heard."""
        heard = self.heard - self._reported[0]
        lost = max(0, self.track.lost - self._reported[1])
        if not heard or self.mean_snr_db is None:
            return None
        self._reported = (self.heard, self.track.lost)
        return self.mean_snr_db, lost / (heard + lost)

    def take_beacon(self, beacon: Beacon) -> bool:
        """Note who it is; True when it has started anew since we last heard a beacon."""
        rebooted = self.boot_id not in (None, beacon.boot_id)
        self.boot_id = beacon.boot_id
        self.reboots += rebooted
        return rebooted

    def disagreement(self, registry: Registry, own: RegistryDigest) -> str | None:
        """In words, where this neighbor's registry differs from ours; None when it does not."""
        if self.digest is None or self.digest.overall == own.overall:
            return None
        differing = []
        for topic_id in own.differing_ids(self.digest):
            topic = registry.by_id(topic_id)
            differing.append(
                f"{topic_id} (ours: {topic.name})" if topic else f"{topic_id} (not ours)"
            )
        where = f"topic id {', '.join(differing)}" if differing else "some topic"
        return (
            f"robot {self.src} has another registry, differing in {where}; "
            f"ours {own.overall.hex()[:8]}, theirs {self.digest.overall.hex()[:8]}. "
            "Give both the same registry file"
        )
