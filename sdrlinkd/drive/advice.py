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
LOSSY_PCT = 10.0
"""Mean loss of a link in % from which it is named."""
REMEDIES = {
    "tx_expired": "send it less often, raise its class or priority, or give it a longer lifespan",
    "tx_superseded": "nothing, if only the newest counts; else raise its depth",
    "tx_topic_full": "send it less often, make it smaller, or raise its queue_bytes",
    "tx_overflow_old": "send less: sdrlinkctl plan says what fits",
    "tx_overflow_new": "send less: sdrlinkctl plan says what fits",
    "tx_too_slow": "make it smaller, or give it a longer lifespan",
    "tx_stalled": "make it smaller, or raise its class",
    "tx_too_big": "make it smaller, or let producers declare topics (auto)",
    "tx_unknown_topic": "add it to the registry, or let producers declare topics (auto)",
    "tx_not_admitted": "reserve less, or free air: sdrlinkctl plan --team",
    "tx_radio_down": "look at the radio: sdrlinkctl doctor",
    "tx_radio_failed": "look at the radio and at this computer's load: sdrlinkctl doctor",
    "rx_partial_timeout": "lower the MCS, or make the messages smaller",
    "rx_expired": "raise its class, or give it a longer lifespan",
    "rx_unknown_topic": "give all robots the same registry",
    "rx_denied": "add the sender to the topic's `from`, if it may send it",
}
"""What helps, by names of the ledger."""
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
    """What lost messages, and what helps."""
    for robot, station in sorted(drive.stations.items()):
        yield from _links(station)
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
            helps = f". What helps: {REMEDIES[name]}" if name in REMEDIES else ""
            yield f"Robot {robot}, {name}: {n} messages, {meaning}{helps}."


def _links(station: Station) -> Iterator[str]:
    """The links on which a robot lost much."""
    for line, losses in sorted(station.lines.get("loss", {}).items()):
        known = [each for each in losses if each is not None]
        if line.endswith(" here") and known and (mean := sum(known) / len(known)) > LOSSY_PCT:
            other = line.removesuffix(" here")
            snrs = [each for each in station.lines["snr"].get(line, ()) if each is not None]
            at = f" at {sum(snrs) / len(snrs):.0f} dB" if snrs else ""
            yield (
                f"Robot {station.robot} lost {mean:.0f} % of the PDUs of {other}{at}. What helps: "
                "a lower MCS (rate), a relay, or a better place for the antenna."
            )
