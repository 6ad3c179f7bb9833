"""Who is heard, how well, and whether both mean the same by a topic id."""

from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field

from sdrlinkd.link.receive.duplicates import SequenceTrack
from sdrlinkd.reports import NeighborReport
from sdrlinkd.wire import Beacon, Registry, RegistryDigest

# Weight of the newest PDU in the mean SNR.
SNR_WEIGHT = 0.2
GAP_DECAY = 0.98
LONGEST_GAP_S = 16.0
"""A half-duplex robot that has nothing to say is heard this often."""
PRESENT_S = 10.0
"""A robot not heard for so long takes no share of the air, and answers nothing."""


@dataclass(slots=True)
class Neighbor:
    """One source of PDUs, as it is heard here."""

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
        """Note when one more PDU came."""
        if self.last_heard_at:
            # A pause is forgotten after some hundred PDUs without one as long; an outage is none.
            gap_s = min(at - self.last_heard_at, LONGEST_GAP_S)
            self.usual_gap_s = max(gap_s, GAP_DECAY * self.usual_gap_s)
        self.last_heard_at = at

    def count_new(self, hops_left: int) -> None:
        """Count one PDU that was not heard before."""
        self.heard += 1
        self.hops_left = hops_left

    def count_duplicate(self) -> None:
        """Count one PDU that was heard before."""
        self.duplicates += 1

    def note_snr(self, snr_db: float | None) -> None:
        """Note the SNR of one more PDU, in dB."""
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

    def take_digest(self, digest: RegistryDigest) -> None:
        """Note which registry it has."""
        self.digest = digest

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
            f"robot {self.src} has a different registry: {where}; "
            f"ours {own.overall.hex()[:8]}, theirs {self.digest.overall.hex()[:8]}. "
            "Give both the same registry file"
        )


class Neighbors:
    """All robots heard, by their ids; `own_id` is among them where a robot hears itself."""

    def __init__(self, own_id: int) -> None:
        self._own_id = own_id
        self._by_src: dict[int, Neighbor] = {}

    def __iter__(self) -> Iterator[Neighbor]:
        return iter(self._by_src.values())

    def get(self, src: int) -> Neighbor | None:
        """What is known of robot `src`; None: it was never heard."""
        return self._by_src.get(src)

    def meet(self, src: int) -> Neighbor:
        """Begin to follow robot `src`, which was not heard before."""
        neighbor = self._by_src[src] = Neighbor(src)
        return neighbor

    def present(self, now: float) -> list[int]:
        """The other robots that were heard within PRESENT_S, in the order of their first PDU."""
        return [
            each.src
            for each in self
            if each.src != self._own_id and now - each.last_heard_at < PRESENT_S
        ]

    def take_qualities(self) -> Iterator[tuple[int, float, float]]:
        """(robot, mean SNR in dB, share of its PDUs lost) of the others heard since the last call.

        Each is taken as it is asked for.
        """
        for each in self:
            quality = each.take_quality() if each.src != self._own_id else None
            if quality is not None:
                yield each.src, *quality

    def report(self, now: float, own: RegistryDigest) -> list[NeighborReport]:
        """Each of them in ascending order of ids, but for clocks and what they tell of us."""
        reports = []
        for src, each in sorted(self._by_src.items()):
            lost, registry = each.track.lost, "unknown"
            if each.digest is not None:
                registry = "same" if each.digest.overall == own.overall else "differs"
            reports.append(
                NeighborReport(
                    src=src,
                    is_self=src == self._own_id,
                    last_heard_s_ago=max(0.0, now - each.last_heard_at),
                    pdus_heard=each.heard,
                    pdus_lost=lost,
                    per=lost / (each.heard + lost) if each.heard + lost else 0.0,
                    usual_gap_s=each.usual_gap_s,
                    duplicates=each.duplicates,
                    hops_left=each.hops_left,
                    reboots=each.reboots,
                    snr_db=each.mean_snr_db,
                    registry=registry,
                )
            )
        return reports

    def counters(self) -> dict[Hashable, int]:
        """The counters of which people are shown rates."""
        found: dict[Hashable, int] = {}
        for src, each in self._by_src.items():
            found["pdus", src] = each.heard
            found["lost", src] = each.track.lost
        return found

    def disagreements(self, registry: Registry, own: RegistryDigest) -> list[str]:
        """In words, whose registry differs from ours, in ascending order of ids."""
        told = (each.disagreement(registry, own) for _, each in sorted(self._by_src.items()))
        return [each for each in told if each is not None]
