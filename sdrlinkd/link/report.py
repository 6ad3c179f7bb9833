"""Builds the link's report from the reports of its parts."""

from collections.abc import Hashable, Mapping
from typing import Any, NamedTuple

import msgspec

from sdrlinkd.link.access import Settled
from sdrlinkd.link.packing import Composer
from sdrlinkd.link.queue import Intake, Outbox
from sdrlinkd.link.receipts import Receipts
from sdrlinkd.link.receive import Reception
from sdrlinkd.link.repeat import Answers, Asking
from sdrlinkd.link.routes import Routes
from sdrlinkd.link.schedule import TeamAir
from sdrlinkd.link.status import RateMeter, admission_report, refused_notices
from sdrlinkd.link.timesync import Clocks
from sdrlinkd.link.topics import HeardTopics, OwnTopics
from sdrlinkd.link.transmit import (
    BurstScheduler,
    ControlRecords,
    NoRadio,
    TransmitReport,
    TxDelayMeters,
)
from sdrlinkd.reports import (
    RATE_WINDOW_S,
    AdmissionReport,
    LinkReport,
    NeighborReport,
    ReceivedTopicReport,
    TopicReport,
    TxReport,
)
from sdrlinkd.sealing import InTheClear, Sealing
from sdrlinkd.wire import FIRST_NUMBER, RegistryDigest, octet

Scheduler = BurstScheduler | NoRadio


class Names(NamedTuple):
    """Names on the bus: of subscribed topics by topic id, and of republished topics by (source,
    topic id).
    """

    subscribed: Mapping[int, str]
    republished: Mapping[tuple[int, int], str]


NO_NAMES = Names({}, {})


class Reporter:
    """Combines the reports of the link's parts and adds rates."""

    def __init__(
        self, topics: OwnTopics, heard_topics: HeardTopics,
        digest: RegistryDigest, outbox: Outbox, intake: Intake, composer: Composer,
        control_records: ControlRecords, tx_delays: TxDelayMeters, reception: Reception,
        receipts: Receipts, clocks: Clocks, sealing: Sealing | InTheClear, asking: Asking,
        answers: Answers, routes: Routes, team_air: TeamAir, own_id: int, pdu_size: int,
    ) -> None:  # fmt: skip
        self._own_id = own_id
        self._asking = asking
        self._answers = answers
        self._routes = routes
        self._team_air = team_air
        self._sealing = sealing
        self._pdu_size = pdu_size
        self._own = topics
        self._heard_topics = heard_topics
        self._registry = topics.registry
        self._digest = digest
        self._outbox = outbox
        self._intake = intake
        self._composer = composer
        self._control_records = control_records
        self._tx_delays = tx_delays
        self._reception = reception
        self._neighbors = reception.neighbors
        self._receipts = receipts
        self._clocks = clocks
        self._rates = RateMeter(RATE_WINDOW_S)

    def sample(self, now: float, scheduler: Scheduler) -> None:
        """Sample the counters at `now`, if the last sample is old enough."""
        if self._rates.is_due(now):
            self._rates.sample(self._counters(scheduler.airtime_s), now)

    def report(self, now: float, names: Names, scheduler: Scheduler) -> LinkReport:
        """The report of the whole link at `now`."""
        sent = scheduler.report()
        per_s = self._rates.all_per_s(self._counters(sent.airtime_s), now)
        records = self._control_records
        return LinkReport(
            pdu_size=self._pdu_size,
            **_access(sent.settled),
            airtime_s=sent.airtime_s,
            air_sent_pct=min(100.0, 1e-4 * per_s["air", "sent"]),
            air_heard_pct=min(100.0, 1e-4 * per_s["air", "heard"]),
            control_airtime_s=sent.control_airtime_s,
            control_period_s=records.period_s,
            airtime_by_class_s={qos.label: round(used_s, 6) for qos, used_s in sent.used_s.items()},
            bursts_by_mcs=dict(sorted(sent.bursts_by_mcs.items())),
            mcs_lowest=sent.mcs_lowest,
            bursts_late=sent.bursts_late,
            mcs_changes=list(sent.mcs_changes),
            control_channel=self._registry.has_control,
            registry_digest=self._digest.overall.hex(),
            security=self._sealing.report(now),
            relayed=self._intake.report_relayed(),
            routes=self._routes.report(now),
            admission=self.reserved(),
            repeats=self._asking.report(self._answers.report()),
            fragments_repaired=self._reception.fragments_repaired,
            receipts_untold=records.receipts_untold,
            receipts_unasked=self._receipts.unasked,
            tx=self._tx(sent),
            rx=self._reception.report(),
            topics=self._topics(per_s, names.subscribed),
            received=self._received(per_s, names.republished),
            neighbors=self._heard(per_s, now, scheduler),
        )

    def notices(self, now: float, of_topics: Mapping[int, str], scheduler: Scheduler) -> list[str]:
        """What a person should know about this link, in sentences.

        `of_topics`: notices by topic id, which apply once a producer uses the topic.
        """
        intake, topics = self._intake, self._own
        notices = [text for each, text in of_topics.items() if intake.tally(each).accepted]
        if not self._registry.has_control:
            notices.append(
                "the registry uses all 16 topic ids, so there is no control channel: no ages, no "
                "beacons, no registry check; remove one topic to get them"
            )
        if not self._control_records.fits:
            notices.append(
                f"PDUs of {self._pdu_size} B have no room for CLOCK records, so no robot "
                "learns another's clock; raise link.pdu_size at all robots"
            )
        notices += [
            f"{topics[topic_id].name} had to wait for a free entry id: fragmented messages come "
            "faster than 256 in 1.25 reassembly timeouts; raise link.pdu_size or shorten "
            "reassembly.timeout_s at all robots"
            for topic_id in self._composer.report().starved
        ]
        notices += self._never_met(scheduler.least_s) + self._stopped(scheduler.round_s)
        notices += scheduler.access_notices(now)
        notices += refused_notices(self._own_id, self.reserved())
        notices += self._heard_topics.notices()
        notices += self._sealing.notices(now)
        if self._reception.own_pdus.has_double(now):
            notices.append(
                f"another robot sends with our id {self._own_id}, or somebody plays what we sent: "
                "give each robot an id of its own (robot_id)"
            )
        return notices + self._neighbors.disagreements(self._registry, self._digest)

    def reserved(self) -> AdmissionReport:
        """The flows of the team that reserve air, and what became of them."""
        return admission_report(self._team_air, self._named)

    def _named(self, src: int, topic: int) -> str:
        """The name of a topic of a robot, as far as it is known here."""
        if src == self._own_id:
            return next((each.name for each in self._own if octet(each.id) == topic), "")
        if topic < FIRST_NUMBER:
            return next((each.name for each in self._registry.topics if each.id == topic), "")
        heard = self._heard_topics.topic(src, topic)
        return "" if heard is None else heard.name

    def _never_met(self, least_s: float) -> list[str]:
        """Sentences on topics with a lifespan below `least_s`, the shortest possible latency."""
        notices = []
        for topic in self._own:
            lifespan_s = self._intake.lifespan(topic.id).seconds
            if lifespan_s < least_s:
                notices.append(
                    f"{topic.name}: lifespan_s of {1e3 * lifespan_s:.3g} ms can never be met: "
                    f"composing and sending one PDU takes {1e3 * least_s:.3g} ms"
                )
        return notices

    def _stopped(self, round_s: float) -> list[str]:
        """Sentences on commands whose dead-man stops this robot between two turns of the sender."""
        reports = self._reception.report_topics()
        ages = [self._reception.report_ages(each.src, each.topic_id) for each in reports]
        return [
            f"{each.name.removeprefix('/')} from robot {each.src}: deadman_s of "
            f"{age.deadman_s:.3g} s has stopped this robot ({age.stops} times), as a turn to send "
            f"comes only every {round_s:.3g} s; raise topic.NAME.deadman_s"
            for each, age in zip(reports, ages, strict=True)
            if age.stops and 0 < age.deadman_s <= round_s
        ]

    def _counters(self, sent_s: float) -> dict[Hashable, int]:
        """All counters for which rates are reported; airtimes are in µs."""
        return {
            ("air", "sent"): round(1e6 * sent_s),
            ("air", "heard"): round(1e6 * self._reception.heard_s),
            **self._intake.counters(),
            **self._reception.counters(),
        }

    def _tx(self, sent: TransmitReport) -> TxReport:
        outbox, composed = self._outbox, self._composer.report()
        accepted, n_sent, dropped = self._intake.totals()
        return TxReport(
            accepted=accepted,
            sent=n_sent,
            queued=outbox.queued,
            queued_bytes=outbox.queued_bytes,
            in_flight=outbox.in_flight,
            dropped=dropped,
            queued_by_class={q.label: n for q, n in outbox.queued_by_class().items()},
            entries=composed.entries,
            pdus_composed=composed.pdus,
            pdus_sent=sent.pdus_sent,
            pdus_failed=sent.pdus_failed,
            bursts_sent=sent.bursts_sent,
            bursts_failed=sent.bursts_failed,
        )

    def _topics(
        self, per_s: Mapping[Hashable, float], names: Mapping[int, str]
    ) -> list[TopicReport]:
        reports = []
        for topic in self._own:
            report = self._intake.report(topic)
            reports.append(
                msgspec.structs.replace(
                    report,
                    name=names.get(topic.id, report.name),
                    subscribed=topic.id in names,
                    accepted_per_s=per_s["tx", topic.id],
                    accepted_bytes_per_s=per_s["accepted_bytes", topic.id],
                    **self._tx_delays.report_ms(topic.id),
                )
            )
        return reports

    def _received(
        self, per_s: Mapping[Hashable, float], names: Mapping[tuple[int, int], str]
    ) -> list[ReceivedTopicReport]:
        reports = []
        for report in self._reception.report_topics():
            key = report.src, report.topic_id
            ages = self._reception.report_ages(*key)
            reports.append(
                msgspec.structs.replace(
                    report,
                    republished_as=names.get(key, ""),
                    delivered_per_s=per_s["rx", *key],
                    delivered_bytes_per_s=per_s["delivered_bytes", *key],
                    age_ms_last=ages.last_ms,
                    age_ms_p50=ages.p50_ms,
                    age_ms_p99=ages.p99_ms,
                    latency=ages.latency,
                    stops=ages.stops,
                )
            )
        return reports

    def _heard(
        self, per_s: Mapping[Hashable, float], now: float, scheduler: Scheduler
    ) -> list[NeighborReport]:
        reports = []
        for report in self._neighbors.report(now, self._digest):
            src = report.src
            heard, lost = per_s["pdus", src], max(0.0, per_s["lost", src])
            there, moves = scheduler.heard_by(src), scheduler.moves(src, now)
            reports.append(
                msgspec.structs.replace(
                    report,
                    per_lately=lost / (heard + lost) if heard + lost > 0 else None,
                    clock=self._clocks.report(src, now),
                    snr_there_db=there.snr_db,
                    per_there=there.per,
                    mcs=there.mcs,
                    doppler_hz=moves.doppler_hz,
                    longest_burst_s=moves.longest_burst_s,
                )
            )
        return reports


def _access(settled: Settled | None) -> dict[str, Any]:
    """The access policy in force, by the field names of `LinkReport`."""
    if settled is None:
        return {"access": "none", "access_reason": "as there is no radio yet"}
    return {
        "access": settled.access.state,
        "access_policy": settled.policy,
        "access_reason": settled.reason,
        "access_share_pct": 100 * settled.share,
    }
