"""Messages carry their age, not a time."""

import pytest

from sdrlinkd.link.receive import MAX_WAITING, Ages
from sdrlinkd.wire import Stamp
from tests.link.world import compose, make_link, send_all


def carry(sender, receiver, sent_at, heard_at, **kwargs):
    """PDUs composed at the sender's time `sent_at` arrive at the receiver's time `heard_at`."""
    return [m for pdu in send_all(sender, sent_at, **kwargs) for m in receiver.hear(pdu, heard_at)]


@pytest.mark.parametrize("size", [20, 51, 60, 724, 2000])
def test_age_needs_no_common_clock(size):
    sender, receiver = make_link(1, pdu_size=64), make_link(2, pdu_size=64)
    sender.submit(0, bytes(size), 100.0)
    (message,) = carry(sender, receiver, sent_at=100.3, heard_at=7.0)
    assert receiver.delivered(message, 7.002) == pytest.approx(0.302, abs=2e-6)


def test_age_grows_between_the_stamp_and_the_last_fragment():
    sender, receiver = make_link(1, pdu_size=64), make_link(2, pdu_size=64)
    sender.submit(0, bytes(80), 0.0)
    first, second = (
        compose(sender, 0.010, 1).pdus[0],
        compose(sender, 0.030, 1).pdus[0],
    )
    assert receiver.hear(second, 5.030) == []
    (message,) = receiver.hear(first, 5.040)
    assert receiver.delivered(message, 5.040) == pytest.approx(0.040, abs=2e-6)


def test_no_stamp_no_age():
    sender, receiver = make_link(1, pdu_size=64), make_link(2, pdu_size=64)
    sender.submit(0, bytes(51), 0.0)
    _, entry_pdu = send_all(sender)
    (message,) = receiver.hear(entry_pdu, 1.0)
    assert receiver.delivered(message, 1.0) is None


def test_a_stale_stamp_is_forgotten():
    ages = Ages(timeout_s=1.0)
    ages.stamp(1, Stamp(2, 3, 500), 10.0)
    ages.expire(10.9, lambda *_: False)
    assert ages.take(1, 2, 3).at == pytest.approx(9.9995)
    ages.stamp(1, Stamp(2, 3, 500), 10.0)
    ages.expire(11.0, lambda *_: False)
    assert ages.take(1, 2, 3).at is None


@pytest.mark.slow
def test_stamps_that_wait_are_bounded():
    ages = Ages(timeout_s=1.0)
    ages.stamp(7, Stamp(1, 1, 500), 0.0)
    for i in range(100_000):
        ages.stamp(i % 7, Stamp(i % 16, i // 16 % 256, 0), 0.0)
    assert len(ages) == 7 * MAX_WAITING + 1
    assert ages.take(7, 1, 1).at is not None, "those of others do not push it out"
