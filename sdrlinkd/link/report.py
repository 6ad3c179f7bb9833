"""The link's report: counters in, frozen structs out."""

from collections import Counter
from collections.abc import Mapping

from sdrlinkd.link.link import Link
from sdrlinkd.link.receive import Neighbor
from sdrlinkd.link.time_report import clock_report, latency_report, waits_ms
from sdrlinkd.reports import (
    LinkReport,
    NeighborReport,
    ReceivedTopicReport,
    RelayReport,
    RxReport,
    TopicReport,
    TxReport,
)

NOTHING_NOTED: Mapping[int, str] = {}


def link_report(
    link: Link, now: float, names_in: dict[int, str], name_out: dict[tuple[int, int], str]
) -> LinkReport:
    """The whole link at `now`.

    `names_in` are the bus topics subscribed to, by topic id; `name_out` the bus topics that
    (source, topic id) are republished as.
    """
    return LinkReport(
        pdu_size=link.params.pdu_size,
        access=link.access.state,
        access_policy=link.scheduler.settled.policy,
        access_reason=link.scheduler.settled.reason,
        access_share_pct=100 * link.scheduler.settled.share,
        airtime_s=link.scheduler.airtime_s,
        air_sent_pct=_air_pct(link, "sent", link.air.sent_s, now),
        air_heard_pct=_air_pct(link, "heard", link.air.heard_s, now),
        control_airtime_s=link.scheduler.control_airtime_s,
        control_period_s=link.control_records.period_s,
        airtime_by_class_s={
            qos.label: round(used_s, 6) for qos, used_s in link.scheduler.shares.used_s.items()
        },
        bursts_by_mcs=dict(sorted(link.scheduler.bursts_by_mcs.items())),
        mcs_lowest=link.rate.lowest if link.rate.adapts else None,
        bursts_late=link.scheduler.bursts_late,
        mcs_changes=list(link.rate.changes),
        control_channel=link.registry.has_control,
        registry_digest=link.digest.overall.hex(),
        relayed=RelayReport(
            accepted=link.sender.relayed.accepted,
            sent=link.sender.relayed.sent,
            dropped=dict(link.sender.relayed.dropped),
        ),
        fragments_repaired=link.inbox.fragments_repaired,
        receipts_untold=link.delivery.receipts_untold,
        receipts_unasked=link.delivery.receipts.unasked,
        tx=_tx(link),
        rx=_rx(link),
        topics=_topics(link, now, names_in),
        received=_received(link, now, name_out),
        neighbors=_neighbors(link, now),
    )


def _air_pct(link: Link, who: str, used_s: float, now: float) -> float:
    """Share of the air lately, in %."""
    return min(100.0, 1e-4 * link.rates.per_s(("air", who), round(1e6 * used_s), now))


def _tx(link: Link) -> TxReport:
    sender = link.sender
    tallies = [
        sender.refused,
        sender.relayed,
        *(sender.tally(topic.id) for topic in link.registry.topics),
    ]
    return TxReport(
        accepted=sum(tally.accepted for tally in tallies),
        sent=sum(tally.sent for tally in tallies),
        queued=sender.outbox.queued,
        queued_bytes=sender.outbox.queued_bytes,
        in_flight=len(sender.lives.in_flight),
        dropped=dict(sum((tally.dropped for tally in tallies), Counter())),
        queued_by_class={q.label: n for q, n in sender.outbox.queued_by_class().items()},
        entries=sender.entries_composed,
        pdus_composed=sender.pdus_composed,
        pdus_sent=sender.pdus_sent,
        pdus_failed=sender.pdus_failed,
        bursts_sent=sender.bursts_sent,
        bursts_failed=sender.bursts_failed,
    )


def _rx(link: Link) -> RxReport:
    inbox = link.inbox
    tallies = inbox.tallies.values()
    return RxReport(
        pdus_heard=inbox.pdus_heard,
        pdus_used=inbox.pdus_used,
        pdus_dropped=dict(inbox.pdus_dropped),
        started=inbox.reassembly.started,
        delivered=sum(tally.delivered for tally in tallies),
        held=inbox.reassembly.held,
        held_bytes=inbox.reassembly.held_bytes,
        dropped=dict(sum((tally.dropped for tally in tallies), Counter())),
        control_bad=inbox.control_bad,
    )


def _topics(link: Link, now: float, names_in: dict[int, str]) -> list[TopicReport]:
    reports = []
    for topic in link.registry.topics:
        tally = link.sender.tally(topic.id)
        qos, priority = link.sender.treatment(topic.id)
        lifespan = link.sender.lifespan(topic.id)
        reports.append(
            TopicReport(
                topic_id=topic.id,
                name=names_in.get(topic.id, "/" + topic.name),
                type=topic.type,
                subscribed=topic.id in names_in,
                qos=qos.label,
                priority=priority,
                lifespan_s=lifespan.seconds if lifespan.source else None,
                lifespan_from=lifespan.source,
                accepted=tally.accepted,
                accepted_per_s=link.rates.per_s(("tx", topic.id), tally.accepted, now),
                accepted_bytes_per_s=link.rates.per_s(
                    ("accepted_bytes", topic.id), tally.accepted_bytes, now
                ),
                sent=tally.sent,
                sent_bytes=tally.sent_bytes,
                reoffered=tally.reoffered,
                queued=link.sender.outbox.queued_of_topic(topic.id),
                dropped=dict(tally.dropped),
                **waits_ms(link, topic.id),
            )
        )
    return reports


def _received(
    link: Link, now: float, name_out: dict[tuple[int, int], str]
) -> list[ReceivedTopicReport]:
    reports = []
    for (src, topic_id), tally in sorted(link.inbox.tallies.items()):
        topic = link.registry.by_id(topic_id)
        ages = link.delivery.latencies.get((src, topic_id))
        ended = tally.delivered + sum(tally.dropped.values())
        reports.append(
            ReceivedTopicReport(
                src=src,
                topic_id=topic_id,
                name="/" + topic.name if topic else f"(topic id {topic_id})",
                republished_as=name_out.get((src, topic_id), ""),
                delivered=tally.delivered,
                delivered_per_s=link.rates.per_s(("rx", src, topic_id), tally.delivered, now),
                delivered_bytes=tally.delivered_bytes,
                delivered_bytes_per_s=link.rates.per_s(
                    ("delivered_bytes", src, topic_id), tally.delivered_bytes, now
                ),
                dropped=dict(tally.dropped),
                pdr=tally.delivered / ended if ended else None,
                age_ms_last=ages.last_ms() if ages else None,
                age_ms_p50=ages.quantile_ms(0.5) if ages else None,
                age_ms_p99=ages.quantile_ms(0.99) if ages else None,
                latency=latency_report(link, src, topic_id) if ages else None,
                stops=link.delivery.deadman.stops.get((src, topic_id), 0),
            )
        )
    return reports


def _neighbors(link: Link, now: float) -> list[NeighborReport]:
    reports = []
    for src, neighbor in sorted(link.inbox.neighbors.items()):
        lost = neighbor.track.lost
        registry = "unknown"
        told = link.rate.told(src)
        if neighbor.digest is not None:
            registry = "same" if neighbor.digest.overall == link.digest.overall else "differs"
        reports.append(
            NeighborReport(
                src=src,
                is_self=src == link.own_id,
                last_heard_s_ago=max(0.0, now - neighbor.last_heard_at),
                pdus_heard=neighbor.heard,
                pdus_lost=lost,
                per=lost / (neighbor.heard + lost) if neighbor.heard + lost else 0.0,
                per_lately=_per_lately(link, neighbor, now),
                usual_gap_s=neighbor.usual_gap_s,
                duplicates=neighbor.duplicates,
                hops_left=neighbor.hops_left,
                reboots=neighbor.reboots,
                snr_db=neighbor.mean_snr_db,
                registry=registry,
                clock=clock_report(link, src, now),
                snr_there_db=told[0] if told else None,
                per_there=told[1] if told else None,
                mcs=link.rate.chosen(src),
            )
        )
    return reports


def _per_lately(link: Link, neighbor: Neighbor, now: float) -> float | None:
    """Its PDUs lost lately over those sent; None where it sent none."""
    heard = link.rates.per_s(("pdus", neighbor.src), neighbor.heard, now)
    lost = max(0.0, link.rates.per_s(("lost", neighbor.src), neighbor.track.lost, now))
    return lost / (heard + lost) if heard + lost > 0 else None


def link_notices(link: Link, now: float, of_topics: Mapping[int, str] = NOTHING_NOTED) -> list[str]:
    """What a person should know about this link, in sentences.

    `of_topics`: what should be known of topics by id, once a producer uses them.
    """
    notices = [text for each, text in of_topics.items() if link.sender.tally(each).accepted]
    if not link.registry.has_control:
        notices.append(
            "the registry uses all 16 topic ids, so there is no control channel: no ages, no "
            "beacons, no registry check; drop one topic to have them"
        )
    if not link.control_records.fits:
        notices.append(
            f"PDUs of {link.params.pdu_size} B have no room for CLOCK records, so nobody knows "
            "anybody's clock; give all robots a larger link.pdu_size"
        )
    for topic_id in sorted(link.sender.packetizer.entry_ids.starved):
        topic = link.registry.topics[topic_id]
        notices.append(
            f"{topic.name} had to wait for a free entry id: fragmented messages come faster than "
            "256 in 1.25 reassembly timeouts; give all robots a larger link.pdu_size or a shorter "
            "reassembly.timeout_s"
        )
    least_s = link.scheduler.least_s
    for topic in link.registry.topics:
        lifespan_s = link.sender.lifespan(topic.id).seconds
        if lifespan_s < least_s:
            notices.append(
                f"{topic.name}: lifespan_s of {1e3 * lifespan_s:.3g} ms can never be met: composing"
                f" and sending one PDU takes {1e3 * least_s:.3g} ms"
            )
    notices += link.access.notices(now)
    for _, neighbor in sorted(link.inbox.neighbors.items()):
        disagreement = neighbor.disagreement(link.registry, link.digest)
        if disagreement:
            notices.append(disagreement)
    return notices
