"""The log of a drive: each event once, in order, and never a flood."""

import itertools
import logging

from sdrlinkd.health import Health, Level, Line
from sdrlinkd.reports import ClockReport
from tests.health.snapshots import robot, snapshot, topic


def story(*snapshots):
    """The log entries, as (level, text)."""
    health = Health()
    lines = [line for each in snapshots for line in health.look(each)]
    return [(line.level.name.lower(), line.text) for line in lines]


def test_a_radio_that_comes_late_goes_and_comes_back():
    absent = {"state": "waiting", "reason": "no such device", "since_s": 1.0}
    away = {"state": "down", "reason": "the stream failed", "since_s": 1.5}
    seen = [
        snapshot(1.0, {"state": "opening", "since_s": 0.5}, []),
        snapshot(2.0, absent, []),
        snapshot(12.0, absent, []),
        snapshot(13.0, robots=[]),
        # A short pause is not an event.
        snapshot(14.0, {**away, "since_s": 0.3}, []),
        snapshot(15.0, robots=[]),
        snapshot(20.0, away, []),
        snapshot(21.0, {**away, "since_s": 2.5}, []),
        snapshot(30.0, robots=[]),
        snapshot(31.0, {"state": "refused", "reason": "got 99"}, []),
    ]
    assert story(*seen) == [
        ("warning", "no radio, still trying: no such device"),
        ("info", "the radio is up after 12 s: usrp"),
        ("warning", "the radio is gone: the stream failed"),
        ("info", "the radio is back after 12 s: usrp"),
        (
            "error",
            (
                "the radio refuses the settings: got 99. The daemon retries after a reload "
                "(SIGHUP) or when it is plugged in again"
            ),
        ),
    ]


def test_a_robot_comes_goes_starts_anew_and_comes_back():
    notice = "robot 2 has a different registry: topic id 2"
    seen = [
        snapshot(1.0, robots=[]),
        snapshot(2.0, robots=[robot(1, is_self=True), robot()]),
        snapshot(3.0),
        snapshot(8.0, robots=[robot(last_heard_s_ago=5.5)]),
        snapshot(9.0, robots=[robot(last_heard_s_ago=6.5)]),
        snapshot(10.0, robots=[robot(reboots=1, snr_db=None)]),
        snapshot(11.0, robots=[robot(reboots=1, registry="differs")], notices=["x", notice]),
        snapshot(12.0, robots=[robot(reboots=1, registry="differs")], notices=[notice]),
        snapshot(13.0, robots=[robot(reboots=1)]),
    ]
    assert story(*seen)[1:] == [
        ("info", "robot 2 is heard at 17 dB"),
        ("warning", "robot 2 is lost: not heard for 6 s"),
        ("info", "robot 2 is heard again"),
        ("info", "robot 2 has restarted"),
        ("warning", notice),
        ("info", "robot 2 has the same registry now"),
    ]


def test_the_slowest_mcs_and_the_way_up_again():
    def at(seconds, mcs):
        return snapshot(seconds, robots=[robot(mcs=mcs, snr_there_db=2.0)], mcs_lowest=0)

    told = story(at(1.0, 4), at(2.0, 0), at(3.0, 0), at(4.0, 2))
    assert told[2:] == [
        ("warning", "the MCS to robot 2 fell to 0, the lowest: it hears us at 2 dB"),
        ("info", "the MCS to robot 2 rose again to 2"),
    ]
    # A fixed one is not news.
    fixed = [snapshot(second, robots=[robot(mcs=0, snr_there_db=2.0)]) for second in (1.0, 2.0)]
    assert len(story(*fixed)) == 2


def test_a_queue_that_overflows_is_told_when_it_begins_and_when_it_ends():
    def at(second):
        dropped = min(max(second - 2, 0), 5) * 10
        return snapshot(float(second), topics=[topic(dropped={"tx_overflow_old": dropped})])

    assert story(*map(at, range(1, 30)))[2:] == [
        (
            "warning",
            (
                "traffic exceeds the channel capacity: messages are dropped, most of "
                "/robot_1/scan; sdrlinkctl why /robot_1/scan says more"
            ),
        ),
        ("info", "traffic fits the channel again: 50 messages dropped in 10 s"),
    ]


def test_a_queue_that_expires_without_a_radio_is_not_blamed_on_traffic():
    def at(second):
        dropped = min(max(second - 2, 0), 5) * 10
        absent = {"state": "waiting", "reason": "no such device"} if second < 20 else None
        return snapshot(float(second), absent, topics=[topic(dropped={"tx_expired": dropped})])

    told = [text for _, text in story(*map(at, range(1, 30)))]
    assert any(text.startswith("there is no radio: messages are dropped") for text in told)
    assert "messages expire no more: 50 messages dropped in 10 s" in told
    assert not any("capacity" in text for text in told)


def test_messages_that_newer_ones_replace_are_told_once_for_each_topic():
    def replaced(second, n, m):
        of_a, of_b = ({"tx_superseded": each} for each in (n, m))
        topics = [topic(name="/a", dropped=of_a), topic(name="/b", dropped=of_b)]
        return snapshot(float(second), topics=topics)

    told = story(replaced(1, 0, 0), replaced(2, 3, 0), replaced(3, 9, 0), replaced(4, 9, 1))
    (a, b) = (line for line in told if "replace" in line[1])
    assert a[1].startswith("/a: newer messages replace those that wait, 3 so far;")
    assert "sdrlinkctl why /b" in b[1]


def test_clocks_that_jump():
    def clock(steps):
        return [robot(clock=ClockReport(state="synced", steps=steps))]

    told = story(
        snapshot(1.0, robots=clock(0)),
        snapshot(2.0, robots=clock(1)),
        snapshot(3.0, robots=clock(1), host_clock_steps=1),
        snapshot(4.0, robots=clock(1), host_clock_steps=1),
    )
    assert told[2:] == [
        ("warning", "robot 2's clock jumped"),
        ("warning", "this host's clock was stepped"),
    ]


def test_what_goes_on_and_off_all_day_does_not_fill_the_log():
    """The log ends with the true state."""
    health, lines = Health(), []
    away = {"state": "down", "reason": "gone", "since_s": 1.5}
    for second, is_away in zip(range(600), itertools.cycle((False, True)), strict=False):
        lines += health.look(snapshot(float(second), away if is_away else None, []))
    told = [line for line in lines if line.subject == "radio"]
    assert len(told) < 50
    assert any("lines suppressed" in line.text for line in told)
    for second in range(600, 640):
        lines += health.look(snapshot(float(second), robots=[]))
    assert [line for line in lines if line.subject == "radio"][-1].text.startswith(
        "the radio is back"
    )


def test_events_are_limited_like_changes_and_the_last_one_is_told():
    health, told = Health(), []
    for second in range(120):
        line = Line("/cmd_vel", Level.WARNING, f"silent at {second}")
        told.append(health.passed(line, float(second)))
        told += health.look(snapshot(float(second), robots=[]))
    texts = [line.text for line in told if line is not None and line.subject == "/cmd_vel"]
    assert texts[:4] == [f"silent at {second}" for second in range(4)]
    assert len(texts) < 15
    assert sum("similar lines suppressed" in text for text in texts) > 5
    assert health.passed(Line("/other", Level.WARNING, "silent"), 120.0) is not None


def test_levels_are_those_of_the_logging_module():
    for level in Level:
        assert logging.getLevelName(level) == level.name
