"""The robots that are heard: how well, and whether their registries agree with ours."""

from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field
from math import inf

from sdrlinkd.link.pauses import usual_gap
from sdrlinkd.link.receive.duplicates import SequenceTrack
from sdrlinkd.reports import NeighborReport
from sdrlinkd.wire import Registry, RegistryDigest

# Weight of the newest PDU in the mean SNR.
SNR_WEIGHT = 0.2
LONGEST_GAP_S = 16.0
"""Longest pause in s that counts: an idle half-duplex robot is heard at least this often."""
PRESENT_S = 10.0
"""Time in s without a PDU after which a robot counts as absent: it uses no airtime and answers
nothing."""


@dataclass(slots=True)
class Neighbor:
    """One robot that is heard, with its statistics."""

    src: int
    track: SequenceTrack = field(default_factory=SequenceTrack)
    heard: int = 0
    duplicates: int = 0
    repaired: int = 0
    last_heard_at: float = 0.0
    usual_gap_s: float = 0.0
    """Longest recent pause between its PDUs, in s."""
    hops_left: int = 0
    snr_db: float | None = None
    mean_snr_db: float | None = None
    direct_at: float = -inf
    """When the last PDU since the last report came directly."""
    boot_id: int | None = None
    _strange_boot_id: int | None = None
    reboots: int = 0
    digest: RegistryDigest | None = None
    _reported: tuple[int, int] = (0, 0)

    def heard_at(self, at: float) -> None:
        """Note the time of one more PDU."""
        if self.last_heard_at:
            # An outage does not count as a pause.
            gap_s = min(at - self.last_heard_at, LONGEST_GAP_S)
            self.usual_gap_s = usual_gap(gap_s, self.usual_gap_s)
        self.last_heard_at = at

    def count_new(self, hops_left: int, *, is_repaired: bool = False) -> None:
        """Count one PDU that was not heard before; `is_repaired`: it was lost, and repeated."""
        self.heard += 1
        self.repaired += is_repaired
        self.hops_left = hops_left

    def count_duplicate(self) -> None:
        """Count one PDU that was heard before."""
        self.duplicates += 1

    def note_snr(self, snr_db: float | None, at: float) -> None:
        """Note the SNR in dB of one more PDU, which came directly."""
        self.direct_at = at
        self.snr_db = snr_db
        if snr_db is None or self.mean_snr_db is None:
            self.mean_snr_db = snr_db
        else:
            self.mean_snr_db += SNR_WEIGHT * (snr_db - self.mean_snr_db)

    def take_quality(self, since: float) -> tuple[float, float] | None:
        """(mean SNR in dB, share of PDUs lost since the last call); None if nothing came directly
        since the last call, or nothing after `since`.

        What was repeated counts as lost, too.
        """
        missed = self.track.lost + self.repaired
        first_heard = self.heard - self.repaired
        heard = first_heard - self._reported[0]
        lost = max(0, missed - self._reported[1])
        direct_at, self.direct_at = self.direct_at, -inf
        if heard <= 0 or direct_at < since or self.mean_snr_db is None:
            return None
        self._reported = (first_heard, missed)
        return self.mean_snr_db, lost / (heard + lost)

    def take_boot_id(self, boot_id: int, *, is_proven: bool) -> bool:
        """Note the boot id in a record of the robot; True if it has restarted.

        In the clear, anybody can tell another boot id, so it counts when it comes a second time.
        """
        if self.boot_id is None or boot_id == self.boot_id:
            self.boot_id, self._strange_boot_id = boot_id, None
            return False
        if not is_proven and boot_id != self._strange_boot_id:
            self._strange_boot_id = boot_id
            return False
        self.boot_id, self._strange_boot_id = boot_id, None
        self.reboots += 1
        return True

    def take_digest(self, digest: RegistryDigest) -> None:
        """Note the digest of the robot's registry."""
        self.digest = digest

    def disagreement(self, registry: Registry, own: RegistryDigest) -> str | None:
        """A sentence on how this neighbor's registry differs from ours; None if it does not."""
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
    """All robots heard, by id; `own_id` is one of them if this robot hears itself."""

    def __init__(self, own_id: int) -> None:
        self._own_id = own_id
        self._by_src: dict[int, Neighbor] = {}

    def __iter__(self) -> Iterator[Neighbor]:
        return iter(self._by_src.values())

    def get(self, src: int) -> Neighbor | None:
        """The statistics of robot `src`; None if it was never heard."""
        return self._by_src.get(src)

    def meet(self, src: int) -> Neighbor:
        """Add robot `src`, which was not heard before."""
        neighbor = self._by_src[src] = Neighbor(src)
        return neighbor

    def present(self, now: float) -> list[int]:
        """Ids of the other robots heard within PRESENT_S, in the order of their first PDU."""
        return [
            each.src
            for each in self
            if each.src != self._own_id and now - each.last_heard_at < PRESENT_S
        ]

    def take_qualities(self, since: float) -> Iterator[tuple[int, float, float]]:
        """(robot, mean SNR in dB, share of its PDUs lost) of the others that were heard directly
        since the last call, and after `since`.

        A robot's counts start anew only when the iterator reaches it.
        """
        for each in self:
            quality = each.take_quality(since) if each.src != self._own_id else None
            if quality is not None:
                yield each.src, *quality

    def report(self, now: float, own: RegistryDigest) -> list[NeighborReport]:
        """Reports on all robots by ascending id, without clocks and their reports about us."""
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
                    pdus_repaired=each.repaired,
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
        """The counters for which rates are reported."""
        found: dict[Hashable, int] = {}
        for src, each in self._by_src.items():
            found["pdus", src] = each.heard
            found["lost", src] = each.track.lost
        return found

    def disagreements(self, registry: Registry, own: RegistryDigest) -> list[str]:
        """Sentences on robots whose registry differs from ours, by ascending id."""
        told = (each.disagreement(registry, own) for _, each in sorted(self._by_src.items()))
        return [each for each in told if each is not None]
