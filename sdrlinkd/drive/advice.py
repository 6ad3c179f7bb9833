"""What to change after a drive, in sentences."""

import re
from collections import Counter
from collections.abc import Iterator

from sdrlinkd.drive.reading import Drive, Station
from sdrlinkd.link import RX_REASONS, TX_REASONS

FIGURE = re.compile(r"\d+(?:\.\d+)?")
MOST = 5
LITTLE = 0.01
"""Share of the time or of the messages below which something is not worth a sentence."""
HARMLESS = ("rx_dup", "rx_control", "rx_own")


def reasons(station: Station) -> list[tuple[str, float]]:
    """(the reason, its share of the time) for which a daemon was not OK, the most frequent first.

    Reasons that differ in figures alone count as one, in the words of the first.
    """
    counts: Counter[str] = Counter()
    words: dict[str, str] = {}
    for reason in filter(None, station.reasons):
        kind = FIGURE.sub("#", reason)
        words.setdefault(kind, reason)
        counts[kind] += 1
    n = len(station.reasons)
    found = [(words[kind], times / n) for kind, times in counts.most_common(MOST)]
    return [each for each in found if each[1] >= LITTLE]


def advice(drive: Drive) -> Iterator[str]:
    """What lost messages, and what its name in the ledger means."""
    for robot, station in sorted(drive.stations.items()):
        for (source, topic), delivery in sorted(station.deliveries.items()):
            pdr = drive.pdr(robot, source, topic)
            if pdr < 1 - LITTLE:
                yield (
                    f"Robot {robot} delivered {100 * pdr:.1f} % of robot {source}'s {topic} "
                    f"({delivery.delivered} messages)."
                )
        ordered = sorted(station.dropped.items(), key=lambda each: -each[1])
        for name, n in [each for each in ordered if each[0] not in HARMLESS][:MOST]:
            meaning = {**TX_REASONS, **RX_REASONS}.get(name, "")
            yield f"Robot {robot} dropped {n} messages as {name}: {meaning}".rstrip(": ")
