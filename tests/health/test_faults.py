"""The words of the verdict on each fault of the list, from a snapshot that has it."""

import re

import pytest
from msgspec.structs import replace

from sdrlinkd.cli.screens import verdict as first_lines
from sdrlinkd.health import Health
from sdrlinkd.reports import OtherLinkReport, ReceivedTopicReport, SecurityReport
from tests.health.faults import IN_THE_CLEAR, SEALED
from tests.health.snapshots import robot, snapshot, topic

VERBS = re.compile(
    r"\b(check|compare|set|lower|raise|copy|end|change|run|look at|start|install|give|plug|"
    r"sdrlinkctl)\b"
)


def grown(**counters):
    """Two snapshots, between which these counters of the radio have grown."""
    before = {"counters": dict.fromkeys(counters, 0)}
    return [snapshot(10.0, carrier=before), snapshot(12.0, carrier={"counters": counters})]


def secured(robots=(), **security):
    seen = snapshot(robots=list(robots))
    return [replace(seen, link=replace(seen.link, security=SecurityReport(**security)))]


def halted(why):
    return secured([robot()], mode="seal", halted=why)


def unbelieved(why, **security):
    return secured(strangers=[f"robot {why}"], **security)


def late():
    odom = ReceivedTopicReport(
        src=2, topic_id=0, name="odom", republished_as="/rx_robot_2/odom", age_ms_p50=44e3,
        delivered_per_s=5.0,
    )  # fmt: skip
    seen = snapshot()
    return [replace(seen, link=replace(seen.link, received=[odom]))]


SEAL = {"mode": "seal"}
OTHER_NETWORK = OtherLinkReport(network=3, pdu_size=1024)
OTHER_SIZE = OtherLinkReport(network=0, pdu_size=512)
STAGED = {
    ("nothing, with a key", 1): secured([robot()], **SEAL),
    ("robot 2 has another key", 1): unbelieved("2 is heard, but uses another key 0", **SEAL),
    ("robot 2 has another key", 2): unbelieved("1 is heard, but uses another key 0", **SEAL),
    ("robot 2 has no key", 1): unbelieved("2 is heard, but sends in the clear", **SEAL),
    ("robot 2 has the key in the mode auth", 1): unbelieved(
        "2 is heard, but uses the mode auth", **SEAL
    ),
    ("robot 2 lost the numbers of its key", 2): halted("the numbers of key 0 are lost here: …"),
    ("robot 2 lost the numbers of its key", 1): secured(
        [robot()], strangers=["robot 2 has lost the numbers of its key"], **SEAL
    ),
    ("the disk of robot 1's state is full", 1): halted("the numbers of sealed PDUs cannot be …"),
    ("another robot has our id and key", 1): halted("another robot has our id 1 and our key: …"),
    ("nothing, without a key", 1): [snapshot()],
    ("robot 2 has no key", 2): unbelieved("1 is heard, but seals its PDUs"),
    ("robot 2 has another network id", 1): [
        snapshot(robots=[], carrier={"network": 0, "others": [OTHER_NETWORK]})
    ],
    ("robot 2 has another PDU size", 1): [
        snapshot(robots=[], carrier={"network": 0, "others": [OTHER_SIZE]})
    ],
    ("a loopback without CPU", 1): [
        snapshot(carrier={"kind": "loopback", "state": "down", "since_s": 2.0})
    ],
    ("robot 2 has another registry", 1): [snapshot(robots=[robot(registry="differs")])],
    ("robot 2 is switched off", 1): [snapshot(robots=[robot(last_heard_s_ago=9.0)])],
    ("robot 2 was never on", 1): [snapshot(robots=[])],
    ("the antenna of robot 1 is off", 1): [snapshot(robots=[robot(last_heard_s_ago=700.0)])],
    ("robot 2 hears robot 1 badly", 1): [snapshot(robots=[robot(per_there=0.2, snr_there_db=3.0)])],
    ("two busy processes beside robot 1", 1): grown(samples_lost=5000),
    ("the event loop of robot 1 lags", 1): [snapshot(loop_lag_ms=900.0)],
    ("the gain of robot 1 is too high", 1): [snapshot(carrier={"clipped_pct": 2.0})],
    ("a tone fills robot 1's band in part", 1): grown(windows_notched=500),
    ("jammers fill more than three eighths of it", 1): grown(windows_not_notched=50),
    ("a jammer of preambles", 1): grown(peaks_skipped=900),
    ("robot 1 sends more than the air carries", 1): [
        snapshot(at, topics=[topic(dropped={"tx_expired": n})]) for at, n in ((10.0, 0), (12.0, 9))
    ],
    ("odometry waits 40 s in robot 1's queue", 1): [
        snapshot(topics=[topic("/robot_1/odom", queued=9, queue_ms=4e4, accepted_per_s=5.0)])
    ],
    ("odometry of robot 2 is 44 s old", 1): late(),
    ("the hub is gone", 1): [
        snapshot(carrier={"kind": "ether", "state": "down", "since_s": 9.0, "reason": "start it"})
    ],
    ("the radio is unplugged", 1): [snapshot(carrier={"state": "down", "since_s": 9.0})],
    ("the radio refuses the frequency", 1): [snapshot(carrier={"state": "refused"})],
    ("robot 1 stops", 1): [snapshot(state="draining")],
}


def test_each_fault_is_staged_or_named():
    listed = {(each.done, each.at) for each in (*SEALED, *IN_THE_CLEAR)}
    assert listed == STAGED.keys()


@pytest.mark.parametrize(
    ("fault", "seal"),
    [
        (fault, seal)
        for seal, faults in (("sealed", SEALED), ("in the clear", IN_THE_CLEAR))
        for fault in faults
    ],
    ids=lambda each: f"{each.done}, at {each.at}" if isinstance(each, tuple) else each,
)
def test_the_first_line_is_that_of_the_list(fault, seal):
    health = Health()
    health.shares_air = True
    seen = STAGED[fault.done, fault.at]
    for each in seen:
        health.look(each)
    told = replace(seen[-1], verdict=health.judge(seen[-1]))
    line = " ".join(first_lines(told, 300, whole=True).plain.split())
    given = {*told.link.security.strangers, told.link.security.halted}
    for reason in told.verdict.reasons:
        if told.state == "running" and told.carrier.state != "refused":
            assert reason in given or VERBS.search(reason)
    if fault.reason:
        assert line.startswith(f"{fault.level}, {seal}: {fault.reason}")
    else:
        assert line == f"{fault.level}, {seal}"
