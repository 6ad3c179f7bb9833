"""A verdict states the worst first, with its reason."""

import re

import pytest
from msgspec.structs import replace

from sdrlinkd.health import Health
from sdrlinkd.reports import OtherLinkReport, ReceivedTopicReport, SecurityReport
from tests.health.snapshots import robot, snapshot, topic

CURE = re.compile(
    "[:;] (compare|check|at robot|sdrlinkctl|copy|raise the|noise does|change|set|end other).*"
)


def verdict(*seen, shares_air=True):
    """The verdict on the last of these snapshots."""
    health = Health()
    health.shares_air = shares_air
    for each in seen:
        health.look(each)
    told = health.judge(seen[-1])
    # What is to be done follows the cause.
    return told.level, [CURE.sub("", reason) for reason in told.reasons]


def test_all_is_well():
    assert verdict(snapshot()) == ("OK", [])


@pytest.mark.parametrize(
    ("carrier", "reason"),
    [
        (
            {"state": "opening", "since_s": 0.0, "reason": "it is being opened"},
            "no radio yet: it is being opened",
        ),
        (
            {"kind": "soapy", "state": "waiting", "since_s": 12.2, "reason": "no such device"},
            "no radio since 12 s: no such device",
        ),
        (
            {"kind": "ether", "state": "waiting", "since_s": 3700, "reason": "no hub answers"},
            "no hub since 1 h 1 min: no hub answers",
        ),
        (
            {"state": "refused", "reason": "soapy.tx_gain_db: got 99"},
            "the radio refuses the settings: soapy.tx_gain_db: got 99",
        ),
        (
            {"state": "down", "since_s": 75, "reason": "it delivers nothing"},
            "no radio since 1 min 15 s: it delivers nothing",
        ),
        ({"kind": "gnuradio", "state": "down", "since_s": 2}, "no flowgraph since 2 s"),
        ({"kind": "iqfile", "state": "ended"}, "the recording has ended"),
    ],
)
def test_without_a_radio_nothing_else_matters(carrier, reason):
    lossy = robot(per_there=0.5)
    assert verdict(snapshot(carrier=carrier, robots=[lossy])) == ("DOWN", [reason])


def test_a_moment_without_samples_is_no_outage():
    assert verdict(snapshot(carrier={"state": "down", "since_s": 0.4})) == ("OK", [])


@pytest.mark.parametrize(
    ("robots", "reasons"),
    [
        ([], ["no robot heard yet"]),
        (
            [robot(per_there=0.04, snr_there_db=3.2)],
            ["robot 2 hears us at 3 dB, 4 % lost"],
        ),
        ([robot(per_there=0.02)], []),
        ([robot(per_lately=0.1, snr_db=5.0)], ["we hear robot 2 at 5 dB, 10 % lost"]),
        ([robot(registry="differs")], ["robot 2 has a different topic registry"]),
        ([robot(last_heard_s_ago=6.0), robot(3)], ["robot 2 not heard for 6 s"]),
        # Its usual pause is as long: half duplex.
        ([robot(last_heard_s_ago=30.0, usual_gap_s=15.0)], []),
        ([robot(last_heard_s_ago=50.0, usual_gap_s=15.0)], ["robot 2 not heard for 50 s"]),
        # Of several, each by itself.
        ([robot(last_heard_s_ago=6.0), robot(3, last_heard_s_ago=7.0)], ["no robot heard for 6 s"]),
        # The robot has left.
        ([robot(last_heard_s_ago=700.0), robot(3)], []),
        ([robot(last_heard_s_ago=7200.0)], ["no robot heard for 2 h 0 min"]),
        # What it reported about us before it fell silent is outdated.
        ([robot(last_heard_s_ago=9.0, per_there=0.5)], ["robot 2 not heard for 9 s"]),
    ],
)
def test_robots(robots, reasons):
    assert verdict(snapshot(robots=robots)) == ("DEGRADED" if reasons else "OK", reasons)


def test_alone_with_a_loopback_is_not_lonely():
    own = robot(1, is_self=True)
    assert verdict(snapshot(robots=[own]), shares_air=False) == ("OK", [])
    assert verdict(snapshot(robots=[own])) == ("DEGRADED", ["no robot heard yet"])


def test_messages_dropped_for_want_of_air():
    def at(seconds, **dropped):
        return snapshot(at=seconds, topics=[topic(dropped=dropped), topic("/robot_1/odom")])

    told = verdict(at(1.0), at(2.0, tx_overflow_old=3, tx_expired=2, tx_throttled=90))
    assert told == (
        "DEGRADED",
        ["traffic exceeds the channel capacity: 5 messages dropped in 5 s, most of /robot_1/scan"],
    )
    over = [at(float(second), tx_overflow_old=3) for second in range(3, 12)]
    assert verdict(at(1.0), at(2.0, tx_overflow_old=3), *over) == ("OK", [])


def test_a_machine_that_is_too_slow_and_a_receiver_that_clips():
    lost = [
        snapshot(at=1.0),
        snapshot(
            at=2.0,
            carrier={"counters": {"samples_lost": 5000}, "clipped_pct": 1.26},
            loop_lag_ms=300.0,
        ),
    ]
    assert verdict(*lost) == (
        "DEGRADED",
        [
            "the CPU is too slow: 5000 samples dropped in 5 s",
            "the receiver clips 1.3 % of the samples: lower its gain",
            "the event loop lags 300 ms: the CPU is busy",
        ],
    )


def test_interference_and_headers_of_no_use():
    def at(seconds, **counters):
        return snapshot(at=seconds, carrier={"counters": counters})

    assert verdict(at(1.0), at(2.0, peaks_skipped=40, headers_refused=3)) == (
        "DEGRADED",
        [
            "interference: 40 preambles skipped in 5 s, as too many before them brought no message",
            (
                "3 headers refused in 5 s: bursts longer than modem.max_burst_s, which should be "
                "the same everywhere, or of another PDU size"
            ),
        ],
    )
    over = [at(float(second), peaks_skipped=40, headers_refused=3) for second in range(3, 12)]
    assert verdict(at(1.0), at(2.0, peaks_skipped=40), *over) == ("OK", [])


def test_stopping_comes_first():
    level, reasons = verdict(snapshot(robots=[], state="draining"))
    assert level == "DEGRADED"
    assert reasons[0].startswith("stopping")


@pytest.mark.parametrize(
    ("robots", "told"),
    [
        # Alone, nothing else matters; beside others, it comes before how these are heard.
        ([], ("DOWN", ["robot 5 is heard, but uses another key"])),
        (
            [robot(per_there=0.1, snr_there_db=9.0)],
            (
                "DEGRADED",
                ["robot 5 is heard, but uses another key", "robot 2 hears us at 9 dB, 10 % lost"],
            ),
        ),
    ],
)
def test_who_is_not_believed_is_named_first(robots, told):
    security = SecurityReport(strangers=["robot 5 is heard, but uses another key"])
    seen = snapshot(robots=robots)
    seen = replace(seen, link=replace(seen.link, security=security))
    assert verdict(seen) == told
    health = Health()
    logged = [line.text for _ in range(3) for line in health.look(seen)]
    assert logged.count("robot 5 is heard, but uses another key") == 1


def test_a_cpu_that_is_too_slow_explains_what_we_do_not_hear():
    lossy = robot(per_lately=0.6, snr_db=20.0)
    before, after = (
        snapshot(at, carrier={"counters": {"samples_lost": n}}, robots=[lossy])
        for at, n in ((10.0, 0), (12.0, 5000))
    )
    assert verdict(before) == ("DEGRADED", ["we hear robot 2 at 20 dB, 60 % lost"])
    assert verdict(before, after) == (
        "DEGRADED", ["the CPU is too slow: 5000 samples dropped in 5 s"],
    )  # fmt: skip


def test_old_messages_are_named_where_they_wait_and_where_they_come():
    waits = topic("/robot_1/odom", queued=224, queue_ms=40_000.0, accepted_per_s=5.0)
    slow = topic("/robot_1/map", queued=1, queue_ms=9_000.0, accepted_per_s=0.5)
    seen = snapshot(topics=[slow, waits])
    late = ReceivedTopicReport(
        src=2, topic_id=0, name="odom", republished_as="/rx_robot_2/odom",
        age_ms_p50=43_953.5, delivered_per_s=5.0,
    )  # fmt: skip
    seen = replace(seen, link=replace(seen.link, received=[late]))
    assert verdict(seen) == (
        "DEGRADED",
        ["/rx_robot_2/odom is 44 s old", "/robot_1/odom waits 40 s in the queue"],
    )
    # What came once, and comes no more, is not judged by its age.
    seen = replace(
        seen, link=replace(seen.link, topics=[], received=[replace(late, delivered_per_s=0.0)])
    )
    assert verdict(seen) == ("OK", [])


OTHER_NETWORK = {"network": 7, "others": [OtherLinkReport(network=9, pdu_size=1024)]}


def test_another_network_is_the_cause_only_of_hearing_nobody():
    gone = robot(last_heard_s_ago=60.0, usual_gap_s=0.1)
    for robots, level in (([], "DOWN"), ([gone], "DOWN"), ([robot()], "OK")):
        told, reasons = verdict(snapshot(carrier=OTHER_NETWORK, robots=robots))
        assert (told, "another network" in " ".join(reasons)) == (level, level == "DOWN")
    alone = snapshot(carrier=OTHER_NETWORK, robots=[])
    assert verdict(alone, shares_air=False)[0] == "DEGRADED"


def test_a_receiver_that_clips_may_explain_why_only_another_network_is_heard():
    clipped = snapshot(carrier=OTHER_NETWORK | {"clipped_pct": 2.0}, robots=[])
    (reason,) = verdict(clipped)[1]
    assert reason.startswith("the receiver clips 2 % of the samples: lower its gain; a robot is")
