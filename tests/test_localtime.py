"""Times of messages by this host's clock."""

import struct

import pytest

from sdrlinkd.link import Delivered, Wall
from sdrlinkd.localtime import UNKNOWN, PublishClock, at_once, header_stamp_ns, local_times
from tests.link.world import make_link

NOW_NS = 1_800_000_000_000_000_000
ERROR_S = 1e-4


def cdr(stamp_ns, little=True):
    form = "<iI" if little else ">iI"
    return bytes([0, little, 0, 0]) + struct.pack(form, *divmod(stamp_ns, 10**9)) + bytes(20)


def message(payload, src=1):
    return Delivered(src, 0, payload, 1, 0, 9.99, 9.995, 1, None, 9.995, 9.996)


@pytest.fixture
def link():
    """A link that hears itself; its clock is that of the host."""
    link = make_link(own_id=1, hears_self=True)
    link.set_wall(Wall(NOW_NS - 10 * 10**9, ERROR_S))
    return link


def test_published_and_measured(link):
    heard = message(cdr(NOW_NS - 25_000_000))
    times = local_times(link, heard, 0.01, 10.0, NOW_NS, True)
    assert times == (NOW_NS - 10_000_000, 100, NOW_NS - 25_000_000, 100)
    assert local_times(link, heard, 0.01, 10.0, NOW_NS, False).sampled_ns is None, "no header"


@pytest.mark.parametrize("off_ns", [1_000_000, 3600 * 10**9, -11 * 10**9, -3600 * 10**9])
def test_data_from_the_future_or_from_long_ago_have_no_time(link, off_ns):
    heard = message(cdr(NOW_NS - 10_000_000 + off_ns))
    times = local_times(link, heard, 0.01, 10.0, NOW_NS, True)
    assert times.published_ns is not None
    assert times.sampled_ns is None


def test_a_robot_whose_clock_is_not_known_has_none(link):
    assert local_times(link, message(cdr(NOW_NS), src=2), 0.01, 10.0, NOW_NS, True) == UNKNOWN
    unset = make_link(own_id=1, hears_self=True)
    assert local_times(unset, message(cdr(NOW_NS)), 0.01, 10.0, NOW_NS, True) == UNKNOWN


@pytest.mark.parametrize("little", [True, False])
def test_stamps_are_read_in_either_byte_order(little):
    assert header_stamp_ns(cdr(1_234_567_890_123, little)) == 1_234_567_890_123


@pytest.mark.parametrize(
    "payload", [b"", b"\0\1\0\0", bytes(11), b"\0\1\0\0" + struct.pack("<iI", 1, 10**9),
                b"\0\1\0\0" + struct.pack("<iI", -1, 0)],
)  # fmt: skip
def test_what_is_no_stamp_is_none(payload):
    assert header_stamp_ns(payload) is None


@pytest.mark.parametrize(
    ("ago_ns", "age_s"),
    [(0, 0.0), (5_000_000, 0.005), (-1, 0.0), (12 * 10**9, 12.0), (3600 * 10**9, 3600.0)],
)
def test_a_message_is_as_old_as_its_producer_says(ago_ns, age_s):
    assert PublishClock().age_s(NOW_NS - ago_ns, NOW_NS, 0) == pytest.approx(age_s)


@pytest.mark.parametrize("step_s", [3600, -3600, 5])
def test_after_the_hosts_clock_was_set_great_ages_are_not_believed(step_s):
    clock, second = PublishClock(), 10**9
    assert clock.age_s(NOW_NS, NOW_NS, 0) == 0.0
    later = NOW_NS + step_s * second
    assert clock.age_s(later - 3600 * second, later + second // 10, second // 10) == 0.0
    # Small ages are believed at once, and all ages once earlier messages must be through.
    assert clock.age_s(later, later + second // 5, second // 5) == pytest.approx(0.2)
    at = later + 11 * second
    assert clock.age_s(at - 12 * second, at, 11 * second) == pytest.approx(12.0)


def test_a_clock_that_is_slewed_was_not_set():
    clock, own_ns, now_ns = PublishClock(), 0, NOW_NS
    for _ in range(100):
        own_ns, now_ns = own_ns + 10**9, now_ns + 10**9 + 500_000
        assert clock.age_s(now_ns - 12 * 10**9, now_ns, own_ns) == pytest.approx(12.0)


@pytest.mark.parametrize("interrupted", [0, 1, 3])
def test_clocks_are_read_again_when_something_came_in_between(interrupted):
    clock = [100.0]
    left = [interrupted]

    def host():
        clock[0] += 0.004 if left[0] else 1e-6
        left[0] = max(0, left[0] - 1)
        return clock[0]

    now, told = at_once(lambda: clock[0], host)
    assert told - now < 2e-6


def test_a_machine_that_always_interrupts_gets_an_answer():
    clock = [0.0]

    def now():
        clock[0] += 1.0
        return clock[0]

    assert at_once(now, lambda: "told")[1] == "told"


def test_what_waited_while_the_loop_slept_is_that_old_at_most():
    clock, second = PublishClock(), 10**9
    clock.turned(0)
    assert clock.age(None, NOW_NS, second // 2) == 0.0
    # Stopped for 30 s; what is read first may come before the loop's own timer.
    assert clock.age(None, NOW_NS, 30 * second) == pytest.approx(30.0)
    clock.turned(30 * second)
    assert clock.age(None, NOW_NS, 30 * second + 1) == pytest.approx(30.0)
    for at in range(30 * second, 31 * second, second // 100):
        clock.turned(at)
    assert clock.age(None, NOW_NS, 31 * second) == 0.0
    # Its own word counts where there is one.
    assert clock.age(NOW_NS - second, NOW_NS, 30 * second + 1) == pytest.approx(1.0)


@pytest.mark.parametrize("awake_s", [0.001, 0.008, 0.03, 0.1])
@pytest.mark.parametrize("asleep_s", [0.07, 0.3, 0.6, 0.99, 1.5])
def test_a_loop_that_stutters_after_a_pause_takes_nothing_old_for_new(awake_s, asleep_s):
    """It has to be awake for a while before what it reads counts as new; then all is as before."""
    clock, awake, asleep = PublishClock(), round(awake_s * 1e9), round(asleep_s * 1e9)
    clock.turned(0)
    now, was_awake, ages = 8 * 10**9, 0, []
    while was_awake < 10**9:
        # Messages come at the begin and at the end of what it is awake, around the loop's turn.
        for at in (now, now + awake // 2, now + awake):
            if at == now + awake // 2:
                clock.turned(at)
            ages.append((was_awake, now, clock.age(None, NOW_NS, at)))
        was_awake += awake
        now += awake + asleep
    for was_awake, at, age in ages:
        if was_awake < 8e6:
            assert age >= 1e-9 * at - 0.2, (was_awake, at, age)
    for at in range(now - asleep, now + 2 * 10**9, 10**7):
        clock.turned(at)
    assert clock.age(None, NOW_NS, now + 2 * 10**9) == 0.0
