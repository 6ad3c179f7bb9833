"""Times of messages by this host's clock."""

import struct

import pytest

from sdrlinkd.link import Delivered, Wall
from sdrlinkd.localtime import UNKNOWN, age_since, header_stamp_ns, local_times
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
    """One that hears itself; its clock is that of the host."""
    link = make_link(own_id=1, hears_self=True)
    link.clocks.wall = Wall(NOW_NS - 10 * 10**9, ERROR_S)
    return link


def test_published_and_measured(link):
    heard = message(cdr(NOW_NS - 25_000_000))
    times = local_times(link, heard, 0.01, 10.0, NOW_NS, {0})
    assert times == (NOW_NS - 10_000_000, 100, NOW_NS - 25_000_000, 100)
    assert local_times(link, heard, 0.01, 10.0, NOW_NS, ()).sampled_ns is None, "no header"


@pytest.mark.parametrize("off_ns", [1_000_000, 3600 * 10**9, -11 * 10**9, -3600 * 10**9])
def test_data_from_the_future_or_from_long_ago_have_no_time(link, off_ns):
    heard = message(cdr(NOW_NS - 10_000_000 + off_ns))
    times = local_times(link, heard, 0.01, 10.0, NOW_NS, {0})
    assert times.published_ns is not None
    assert times.sampled_ns is None


def test_a_robot_whose_clock_is_not_known_has_none(link):
    assert local_times(link, message(cdr(NOW_NS), src=2), 0.01, 10.0, NOW_NS, {0}) == UNKNOWN
    link.clocks.wall = None
    assert local_times(link, message(cdr(NOW_NS)), 0.01, 10.0, NOW_NS, {0}) == UNKNOWN


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
    ("ago_ns", "age_s"), [(0, 0.0), (5_000_000, 0.005), (-1, 0.0), (3600 * 10**9, 0.0)]
)
def test_the_age_of_what_was_published_by_another_clock_counts_from_now(ago_ns, age_s):
    assert age_since(NOW_NS - ago_ns, NOW_NS) == pytest.approx(age_s)
